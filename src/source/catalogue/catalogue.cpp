#include "source/catalogue/catalogue.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <list>
#include <map>
#include <mutex>
#include <numeric>
#include <set>
#include <utility>

#include <glm/common.hpp>

namespace tellurion::source {
namespace {

constexpr std::uint32_t kLeafSize = 4;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Box {
  glm::vec3 lower{kInfinity};
  glm::vec3 upper{-kInfinity};
};

/// Holds the cap.
Box box_of(const SphereCap& cap) {
  constexpr float kRounding = 1e-6f;
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    // Along an axis the cap reaches the cosine of (its middle's angle to the axis - its radius), or the pole of the axis itself.
    const double c = std::clamp(cap.middle[axis], -1.0, 1.0);
    const double s = std::sqrt(1.0 - c * c);
    const double up = c >= cap.cosine ? 1.0 : c * cap.cosine + s * cap.sine;
    const double down = -c >= cap.cosine ? -1.0 : c * cap.cosine - s * cap.sine;
    box.lower[axis] = static_cast<float>(down) - kRounding;
    box.upper[axis] = static_cast<float>(up) + kRounding;
  }
  return box;
}

void grow(Box& box, const Box& other) {
  box.lower = glm::min(box.lower, other.lower);
  box.upper = glm::max(box.upper, other.upper);
}

float rounded_down(double value) { return std::nextafter(static_cast<float>(value), 0.0f); }
float rounded_up(double value) { return std::nextafter(static_cast<float>(value), kInfinity); }

}  // namespace

// --- What is open ----------------------------------------------------------------------------------------------------

struct OpenDataSets::State {
  using Source = std::shared_ptr<const RasterSource>;
  explicit State(Open how) : open(std::move(how)) {}

  Source find(std::uint32_t id) {
    const auto found = index.find(id);
    if (found == index.end()) return nullptr;
    used.splice(used.begin(), used, found->second);
    return found->second->second;
  }

  Open open;
  mutable std::mutex mutex;  ///< guards what follows; never held while a raster is opened
  std::list<std::pair<std::uint32_t, Source>> used;  ///< the most recently used first
  std::map<std::uint32_t, std::list<std::pair<std::uint32_t, Source>>::iterator> index;
  std::map<std::uint32_t, Error> failed;
  std::string last_error;
  std::set<std::uint32_t> opened;
};

OpenDataSets::OpenDataSets(Open open) : state_(std::make_unique<State>(std::move(open))) {}
OpenDataSets::~OpenDataSets() = default;

Result<std::shared_ptr<const RasterSource>> OpenDataSets::open(const DataSet& set) {
  State& s = *state_;
  {
    std::lock_guard lock(s.mutex);
    if (auto source = s.find(set.id)) return source;
    if (const auto failed = s.failed.find(set.id); failed != s.failed.end()) return failed->second;
  }
  auto opened = s.open(set.path);
  std::lock_guard lock(s.mutex);
  if (!opened) {
    s.last_error = opened.error().message;
    if (opened.error().code != ErrorCode::unavailable) s.failed.emplace(set.id, opened.error());
    return opened.error();
  }
  if (auto source = s.find(set.id)) return source;
  State::Source source = std::move(*opened);
  s.used.emplace_front(set.id, source);
  s.index[set.id] = s.used.begin();
  s.opened.insert(set.id);
  if (s.used.size() > kMostOpen) {
    s.index.erase(s.used.back().first);
    s.used.pop_back();
  }
  return source;
}

OpenDataSets::Failures OpenDataSets::failures() const {
  std::lock_guard lock(state_->mutex);
  return {static_cast<std::int64_t>(state_->failed.size()), state_->last_error};
}

std::vector<std::uint32_t> OpenDataSets::opened_ids() const {
  std::lock_guard lock(state_->mutex);
  return {state_->opened.begin(), state_->opened.end()};
}

// --- The catalogue ---------------------------------------------------------------------------------------------------

Catalogue::Catalogue(Sets sets, CatalogueOrder order, std::shared_ptr<OpenDataSets> open)
    : sets_(std::move(sets)), order_(order), open_(std::move(open)) {
  std::ranges::sort(sets_, [order](const auto& a, const auto& b) {
    const double fine_a = a->footprint.spacing().value, fine_b = b->footprint.spacing().value;
    if (order == CatalogueOrder::finest && fine_a != fine_b) return fine_a > fine_b;
    return std::pair(a->place, a->id) < std::pair(b->place, b->id);
  });
  leaves_.resize(sets_.size());
  std::iota(leaves_.begin(), leaves_.end(), 0u);
  nodes_.reserve(sets_.size());
  if (!sets_.empty()) build(0, static_cast<std::uint32_t>(sets_.size()));
}

/// The subtree over some leaves: halves by their middles along the longest axis. Returns its root.
std::uint32_t Catalogue::build(std::uint32_t first, std::uint32_t end) {
  const auto at = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Box box, middles;
  Node node;
  node.finest = kInfinity;
  for (std::uint32_t i = first; i < end; ++i) {
    const Footprint& footprint = sets_[leaves_[i]]->footprint;
    grow(box, box_of(footprint.cap()));
    const glm::vec3 middle(footprint.cap().middle);
    grow(middles, {middle, middle});
    node.finest = std::min(node.finest, rounded_down(footprint.spacing().value));
    node.widest = std::max(node.widest, rounded_up(footprint.extent().value));
  }
  node.lower = box.lower;
  node.upper = box.upper;
  if (end - first <= kLeafSize) {
    node.first = first;
    node.count = end - first;
  } else {
    const glm::vec3 size = middles.upper - middles.lower;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::uint32_t half = (first + end) / 2;
    const auto begin = leaves_.begin();
    std::nth_element(begin + first, begin + half, begin + end,
                     [&](std::uint32_t a, std::uint32_t b) { return sets_[a]->footprint.cap().middle[axis] < sets_[b]->footprint.cap().middle[axis]; });
    build(first, half);
    node.first = build(half, end);
  }
  nodes_[at] = node;
  return at;
}

/// Calls `visit` with the index of each data set whose node's box meets the region and whose nodes `enter` lets through; ends when
/// `visit` returns true.
template <class Enter, class Visit>
void Catalogue::walk(const FaceRegion& region, const Enter& enter, const Visit& visit) const {
  if (nodes_.empty()) return;
  const Box box = box_of(region.cap);
  constexpr std::size_t kDepth = 40;  // of halves of 32-bit counts
  std::uint32_t waiting[kDepth];
  std::size_t count = 0;
  std::uint32_t at = 0;
  for (;;) {
    const Node& node = nodes_[at];
    const bool meets = node.lower.x <= box.upper.x && box.lower.x <= node.upper.x && node.lower.y <= box.upper.y && box.lower.y <= node.upper.y &&
                       node.lower.z <= box.upper.z && box.lower.z <= node.upper.z;
    if (meets && enter(node)) {
      if (node.count == 0) {
        waiting[count++] = node.first;
        ++at;
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        if (visit(leaves_[i])) return;
      }
    }
    if (count == 0) return;
    at = waiting[--count];
  }
}

bool Catalogue::touches(const geo::TileKey& tile) const {
  const FaceRegion region = region_of(tile);
  bool found = false;
  walk(region, [](const Node&) { return true; }, [&](std::uint32_t i) { return found = sets_[i]->footprint.touches(region); });
  return found;
}

Metres Catalogue::spacing_under(const geo::TileKey& tile) const {
  const FaceRegion region = region_of(tile);
  double finest = std::numeric_limits<double>::infinity();
  walk(region, [&](const Node& node) { return static_cast<double>(node.finest) < finest; },
       [&](std::uint32_t i) {
         const Footprint& footprint = sets_[i]->footprint;
         if (footprint.spacing().value < finest && footprint.touches(region)) finest = footprint.spacing().value;
         return false;
       });
  return Metres(finest);
}

void Catalogue::find(const FaceRegion& region, Radians least_extent, std::vector<std::uint32_t>& found) const {
  found.clear();
  walk(region, [&](const Node& node) { return static_cast<double>(node.widest) >= least_extent.value; },
       [&](std::uint32_t i) {
         const Footprint& footprint = sets_[i]->footprint;
         if (footprint.extent().value >= least_extent.value && footprint.touches(region)) found.push_back(i);
         return false;
       });
  std::ranges::sort(found, std::greater<>());
}

std::shared_ptr<const Catalogue> Catalogue::changed(Sets more, std::span<const std::uint32_t> gone) const {
  Sets sets;
  sets.reserve(sets_.size() + more.size());
  std::ranges::copy_if(sets_, std::back_inserter(sets), [&](const auto& set) { return !std::ranges::binary_search(gone, set->id); });
  std::ranges::move(more, std::back_inserter(sets));
  return std::make_shared<const Catalogue>(std::move(sets), order_, open_);
}

Catalogue::Sets difference(const Catalogue& before, const Catalogue& now) {
  const auto by_id = [](const auto& a, const auto& b) { return a->id < b->id; };
  Catalogue::Sets a = before.sets(), b = now.sets(), only;
  std::ranges::sort(a, by_id);
  std::ranges::sort(b, by_id);
  std::ranges::set_symmetric_difference(a, b, std::back_inserter(only), by_id);
  return only;
}

}  // namespace tellurion::source
