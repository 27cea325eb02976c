#include "globe/prefetch.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

#include <glm/common.hpp>


namespace tellurion::globe {
namespace {

using Clock = std::chrono::steady_clock;
using source::RasterDescription;

constexpr std::size_t kMostPending = 64;   ///< blocks whose bytes are on their way
constexpr double kPieceDegrees = 60.0;     ///< of longitude: regions are looked at in pieces, within which columns do not jump
constexpr std::chrono::milliseconds kPauseBeforeAgain{5500};  ///< longer than fetch::StoreOptions::pause_after_failure
constexpr int kPieceSteps = 48;            ///< places looked at along a piece's sides, and inside of it

/// Metres between the samples of level 0 at the equator; of other maps than Web Mercator those of the data.
double spacing_at_equator(const RasterDescription& about) {
  if (about.crs_wkt != "EPSG:3857") return about.spacing.value;
  // `spacing` is that of the middle of the bounds on the map.
  const auto on_map = [](Radians latitude) { return std::asinh(std::tan(latitude.value)); };
  return about.spacing.value * std::cosh(0.5 * (on_map(about.bounds.south) + on_map(about.bounds.north)));
}

/// The zoom of the raster's finest level.
int finest_zoom(const LayerSpec& spec, const RasterDescription& about, const geo::Ellipsoid& world) {
  if (spec.source.type == "xyz") {
    const int across = spec.source.projection == "geographic" ? 2 : 1;
    return static_cast<int>(std::lround(std::log2(static_cast<double>(about.levels.front().width) / (across * spec.source.tile_size))));
  }
  const double zoom_0 = 2.0 * std::numbers::pi * world.a() / 256.0;
  return static_cast<int>(std::lround(std::log2(zoom_0 / spacing_at_equator(about))));
}

/// Part of a region within the source's own bounds, degrees, west < east.
struct Piece {
  double west, south, east, north;
};

std::vector<Piece> pieces_of(std::array<double, 4> bounds, const geo::GeodeticBounds& own) {
  auto [west, south, east, north] = bounds;
  if (east <= west) east += 360.0;
  south = std::max(south, to_degrees(own.south).value);
  north = std::min(north, to_degrees(own.north).value);
  std::vector<Piece> pieces;
  if (!(south < north)) return pieces;
  for (const double turn : {-720.0, -360.0, 0.0, 360.0, 720.0}) {
    const double from = std::max(west, to_degrees(own.west).value + turn), to = std::min(east, to_degrees(own.east).value + turn);
    if (!(from < to)) continue;
    const int count = static_cast<int>(std::ceil((to - from) / kPieceDegrees));
    for (int i = 0; i < count; ++i) pieces.push_back({from + i * (to - from) / count, south, from + (i + 1) * (to - from) / count, north});
  }
  return pieces;
}

/// The pixels of level 0 that hold a piece; may reach beyond the last column where columns go round. Nothing if it has none.
std::optional<std::pair<glm::dvec2, glm::dvec2>> pixels_of(const Piece& piece, source::RasterReader& reader, const RasterDescription& about) {
  std::vector<geo::LatLon> places;
  for (int j = 0; j <= kPieceSteps; ++j) {
    for (int i = 0; i <= kPieceSteps; ++i) {
      // Just inside, so that a region's edge on the border of tiles does not ask for the next ones.
      const double x = std::clamp(static_cast<double>(i) / kPieceSteps, 1e-9, 1.0 - 1e-9), y = std::clamp(static_cast<double>(j) / kPieceSteps, 1e-9, 1.0 - 1e-9);
      places.push_back({to_radians(Degrees(piece.south + y * (piece.north - piece.south))), to_radians(Degrees(piece.west + x * (piece.east - piece.west)))});
    }
  }
  std::vector<glm::dvec2> pixels(places.size());
  reader.to_pixels(places, pixels);
  const double width = about.levels.front().width;
  glm::dvec2 low(std::numeric_limits<double>::infinity()), high(-low);
  double first = std::nan("");
  for (glm::dvec2 pixel : pixels) {
    if (!std::isfinite(pixel.x) || !std::isfinite(pixel.y)) continue;
    if (std::isnan(first)) first = pixel.x;
    if (about.wraps) pixel.x = first + std::remainder(pixel.x - first, width);
    low = glm::min(low, pixel);
    high = glm::max(high, pixel);
  }
  if (!(low.x <= high.x)) return std::nullopt;
  if (about.wraps && low.x < 0.0) {
    low.x += width;
    high.x += width;
  }
  return std::pair(low, high);
}

/// Rectangles with the same rows that touch one another become one.
void add_merged(std::vector<Prefetch::Part>& parts, std::size_t first, const Prefetch::Part& part) {
  for (std::size_t i = first; i < parts.size(); ++i) {
    Prefetch::Part& old = parts[i];
    const bool touches = old.row == part.row && old.rows == part.rows && part.column <= old.column + old.columns && old.column <= part.column + part.columns;
    if (!touches) continue;
    const int end = std::max(old.column + old.columns, part.column + part.columns);
    old.column = std::min(old.column, part.column);
    old.columns = end - old.column;
    return;
  }
  parts.push_back(part);
}

}  // namespace

Result<Prefetch> Prefetch::plan(const Globe& globe, const PrefetchArea& area) {
  Prefetch plan;
  for (std::size_t i = 0; i < globe.layer_count(); ++i) {
    const LayerSpec& spec = globe.layer(i).spec;
    const auto raster = globe.raster_at(i, area.time);
    if (!raster || !raster->description().is_remote) continue;
    auto reader = raster->open_reader();
    if (!reader) return reader.error();
    plan.sources_.push_back({raster, std::move(*reader), spec.group == LayerGroup::height});
    plan.add_parts(spec, plan.sources_.size() - 1, area);
  }
  return plan;
}

void Prefetch::add_parts(const LayerSpec& spec, std::size_t source, const PrefetchArea& area) {
  source::RasterReader& reader = *sources_[source].reader;
  const RasterDescription& about = sources_[source].raster->description();
  const bool own_zooms = spec.source.type == "xyz";
  const int finest = finest_zoom(spec, about, about.ellipsoid);
  int last = area.zooms.second;
  if (area.metres_per_pixel) last = finest - static_cast<int>(std::floor(std::log2(*area.metres_per_pixel / about.spacing.value) + 1e-9));
  std::vector<std::pair<glm::dvec2, glm::dvec2>> ranges;
  for (const Piece& piece : pieces_of(area.bounds, about.bounds)) {
    if (const auto range = pixels_of(piece, reader, about)) ranges.push_back(*range);
  }
  const int least = own_zooms ? spec.source.min_level : finest - static_cast<int>(about.levels.size()) + 1;
  for (int zoom = std::max(area.zooms.first, least); zoom <= std::min(last, finest); ++zoom) {
    const int level = finest - zoom;
    if (level >= static_cast<int>(about.levels.size())) continue;
    const source::LevelSize size = about.levels[static_cast<std::size_t>(level)];
    const glm::dvec2 scale = source::level_scale(about, level);
    Part part{source, spec.name, zoom, level, own_zooms ? spec.source.tile_size : 256, 0, 0, 0, 0};
    const int all_columns = (size.width + part.block - 1) / part.block, all_rows = (size.height + part.block - 1) / part.block;
    const std::size_t first = parts_.size();
    for (const auto& [low, high] : ranges) {
      const glm::dvec2 from = glm::floor(low * scale / static_cast<double>(part.block)), to = glm::floor(high * scale / static_cast<double>(part.block)) + 1.0;
      part.row = std::clamp(static_cast<int>(from.y), 0, all_rows - 1);
      part.rows = std::clamp(static_cast<int>(to.y), part.row + 1, all_rows) - part.row;
      const int begin = std::clamp(static_cast<int>(from.x), 0, 2 * all_columns - 1), end = std::max(static_cast<int>(to.x), begin + 1);
      for (const int turn : {0, all_columns}) {  // what lies beyond the last column is column 0 again
        part.column = std::max(begin - turn, 0);
        part.columns = std::min(end - turn, all_columns) - part.column;
        if (part.columns > 0 && (turn == 0 || about.wraps)) add_merged(parts_, first, part);
      }
    }
  }
}

std::int64_t Prefetch::count() const {
  std::int64_t sum = 0;
  for (const Part& part : parts_) sum += part.count();
  return sum;
}

double Prefetch::estimated_bytes(double bytes_per_tile) const {
  double sum = 0;
  for (const Part& part : parts_) sum += static_cast<double>(part.count()) * bytes_per_tile * (part.block / 256.0) * (part.block / 256.0);
  return sum;
}

Result<void> Prefetch::read(const Block& block) {
  const Part& part = parts_[block.part];
  Source& from = sources_[part.source];
  const source::LevelSize size = from.raster->description().levels[static_cast<std::size_t>(part.level)];
  source::PixelWindow window;
  window.x = static_cast<int>((part.column + block.number % part.columns) * part.block);
  window.y = static_cast<int>((part.row + block.number / part.columns) * part.block);
  window.width = std::min(part.block, size.width - window.x);
  window.height = std::min(part.block, size.height - window.y);
  if (from.heights) {
    const auto read = from.reader->read_heights(part.level, window);
    return read ? Result<void>() : Result<void>(read.error());
  }
  const auto read = from.reader->read_colours(part.level, window);
  return read ? Result<void>() : Result<void>(read.error());
}

/// Goes through blocks with some of them on their way at a time.
class Prefetch::Round {
 public:
  Round(Prefetch& plan, PrefetchProgress& progress) : plan_(plan), progress_(progress) {}

  /// Takes a block; gives back whether it could be settled or is waited for now.
  void take(Block block) {
    const Result<void> read = plan_.read(block);
    block.awaited = plan_.sources_[plan_.parts_[block.part].source].reader->take_awaited();
    if (read) {
      ++progress_.done;
      failed_in_a_row_ = 0;
    } else if (read.error().code == ErrorCode::pending) {
      pending_.push_back(std::move(block));
    } else {
      ++progress_.failed;
      ++failed_in_a_row_;
      progress_.last_error = read.error().message;
      block.awaited.clear();
      failed_.push_back(std::move(block));
    }
  }

  /// Takes those up again whose bytes have come; false if there are none.
  bool take_arrived() {
    std::vector<Block> arrived;
    std::erase_if(pending_, [&](Block& block) {
      if (!std::ranges::all_of(block.awaited, [](const auto& arrival) { return arrival->over(); })) return false;
      arrived.push_back(std::move(block));
      return true;
    });
    for (Block& block : arrived) take(std::move(block));
    return !arrived.empty();
  }

  bool has_room() const { return pending_.size() < kMostPending; }
  bool is_idle() const { return pending_.empty(); }
  bool is_hopeless() const { return failed_in_a_row_ >= kHopeless; }
  std::vector<Block> take_failed() { return std::exchange(failed_, {}); }

 private:
  Prefetch& plan_;
  PrefetchProgress& progress_;
  std::vector<Block> pending_;
  std::vector<Block> failed_;
  int failed_in_a_row_ = 0;
};

PrefetchProgress Prefetch::run(const std::function<bool(const PrefetchProgress&)>& go_on) {
  PrefetchProgress progress;
  Round round(*this, progress);
  auto last_told = Clock::now();
  const auto may_go_on = [&] {
    const auto now = Clock::now();
    if (!progress.stopped && now - last_told >= std::chrono::milliseconds(100)) {
      last_told = now;
      progress.stopped = !go_on(progress);
    }
    return !progress.stopped && !round.is_hopeless();
  };
  const auto wait = [&] {
    if (!round.take_arrived()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  };
  const auto work_off = [&](auto&& next) {
    for (bool more = true; may_go_on() && (more || !round.is_idle());) {
      if (more && round.has_room()) more = next();
      else wait();
      if (more) round.take_arrived();
    }
  };
  std::size_t part = 0;
  std::int64_t number = 0;
  work_off([&] {
    while (part < parts_.size() && number == parts_[part].count()) ++part, number = 0;
    if (part == parts_.size()) return false;
    round.take({part, number++, {}});
    return true;
  });
  std::vector<Block> again = round.take_failed();
  if (!again.empty() && progress.done > 0) {
    // What failed just now is not asked for again at once.
    const auto ready = Clock::now() + kPauseBeforeAgain;
    while (may_go_on() && Clock::now() < ready) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    progress.failed = 0;
    work_off([&] {
      if (again.empty()) return false;
      Block block = std::move(again.back());
      again.pop_back();
      round.take(std::move(block));
      return true;
    });
    progress.failed += static_cast<std::int64_t>(again.size());
  }
  go_on(progress);
  return progress;
}

}  // namespace tellurion::globe
