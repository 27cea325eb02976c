#include "globe/surface_steps.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "base/log.h"

namespace tellurion::globe {
namespace {

/// The layer as if it had but this one step.
LayerSpec spec_of_step(const LayerSpec& layer, const std::string& time) {
  LayerSpec spec = layer;
  spec.source.time.reset();
  spec.source.path = source::with_time(layer.source.path.string(), time);
  spec.source.url = source::with_time(layer.source.url, time);
  return spec;
}

/// Of a layer of images. What lies over the grayscale is drawn as colours are: it follows them in the order of groups.
surface::ImageUse use_of(LayerGroup group) {
  switch (group) {
    case LayerGroup::grayscale: return surface::ImageUse::grayscale;
    case LayerGroup::water: return surface::ImageUse::water;
    case LayerGroup::night: return surface::ImageUse::night;
    case LayerGroup::overlay: return surface::ImageUse::overlay;
    case LayerGroup::normal: return surface::ImageUse::normal;
    case LayerGroup::height:
    case LayerGroup::color:
    case LayerGroup::grayscale_overlay: break;
  }
  return surface::ImageUse::colour;
}

}  // namespace

SurfaceSteps::OneLayer::OneLayer(const LayerSpec& s) : spec(s), settings(s) {
  if (!spec.source.time) return;
  if (auto times = source::TimeSteps::create(*spec.source.time)) timed = TimedLayer{std::move(*times), {}, {}, {}};
}

SurfaceSteps::SurfaceSteps(const geo::Ellipsoid& ellipsoid, const std::vector<LayerInfo>& layers, OpenSource open) : ellipsoid_(ellipsoid), open_(std::move(open)) {
  for (const LayerInfo& info : layers) {
    OneLayer& layer = layers_[append(info.spec)];
    layer.fixed = info.raster;
    layer.catalogue = info.catalogue;
  }
}

/// With the lock held.
std::size_t SurfaceSteps::append(const LayerSpec& spec) {
  const std::size_t added = layers_.size();
  OneLayer& layer = layers_.emplace_back(spec);
  layer.id = next_id_++;
  has_times_ = has_times_ || layer.timed.has_value();
  // Groups draw in their order, whatever the file's.
  order_.insert(std::ranges::upper_bound(order_, spec.group, {}, [&](std::size_t i) { return layers_[i].spec.group; }), added);
  return added;
}

SurfaceSteps::OneLayer& SurfaceSteps::layer_at(std::size_t layer) {
  std::lock_guard lock(mutex_);
  return layers_[layer];
}

std::size_t SurfaceSteps::add(const LayerSpec& spec) {
  std::lock_guard lock(mutex_);
  const std::size_t added = append(spec);
  if (layers_[added].timed) {
    surfaces_.clear();  // which of its steps they would show is not known
  } else {
    for (auto& [steps, surface] : surfaces_) steps.push_back(0);
  }
  return added;
}

void SurfaceSteps::remove(std::size_t layer) {
  std::lock_guard lock(mutex_);
  OneLayer& gone = layers_[layer];
  if (gone.removed) return;
  gone.removed = true;
  gone.settings.enabled = false;
  gone.fixed = nullptr;
  gone.catalogue = nullptr;
  if (gone.timed) gone.timed->open.clear();
  std::erase(order_, layer);
  describe_anew();
}

/// With the lock held.
void SurfaceSteps::find_steps(const std::optional<UtcTime>& time, Steps& steps) const {
  steps.clear();
  for (const OneLayer& layer : layers_) steps.push_back(layer.timed ? layer.timed->times.step_at(time) : 0);
}

SurfaceSteps::Source SurfaceSteps::source_of(OneLayer& layer, std::int64_t step) {
  TimedLayer& timed = *layer.timed;
  const auto find = [&]() -> std::optional<Source> {
    const auto held = std::ranges::find(timed.open, step, [](const auto& entry) { return entry.first; });
    if (held == timed.open.end()) return std::nullopt;
    timed.open.splice(timed.open.begin(), timed.open, held);
    return held->second;
  };
  std::uint64_t reopened = 0;
  {
    std::lock_guard lock(mutex_);
    if (const auto source = find()) return *source;
    reopened = reopened_;
  }
  auto opened = open_(spec_of_step(layer.spec, timed.times.text(step)));
  std::lock_guard lock(mutex_);
  if (const auto source = find()) return *source;  // another thread was faster
  Source source;
  if (opened) {
    source = std::move(*opened);
  } else {
    if (timed.failures.count++ == 0) log::warning(opened.error().message);
    timed.failures.last_error = opened.error().message;
  }
  if (timed.ids.emplace(step, next_id_).second) ++next_id_;
  if (layer.removed || reopened != reopened_) return source;
  timed.open.emplace_front(step, source);
  if (timed.open.size() > kHeldSources) timed.open.pop_back();
  return source;
}

std::shared_ptr<const surface::SurfaceDescription> SurfaceSteps::held(const Steps& steps) {
  const auto found = std::ranges::find(surfaces_, steps, [](const auto& entry) { return entry.first; });
  if (found == surfaces_.end()) return nullptr;
  surfaces_.splice(surfaces_.begin(), surfaces_, found);
  return found->second;
}

std::shared_ptr<const surface::SurfaceDescription> SurfaceSteps::held_at(const std::optional<UtcTime>& time) {
  std::lock_guard lock(mutex_);
  if (!has_times_ && !surfaces_.empty()) return surfaces_.front().second;
  find_steps(time, asked_steps_);
  return held(asked_steps_);
}

std::shared_ptr<const surface::SurfaceDescription> SurfaceSteps::at(const std::optional<UtcTime>& time) {
  for (;;) {
    if (auto same = held_at(time)) return same;
    Steps steps;
    std::vector<OneLayer*> timed;  // null: nothing of it is to be opened
    std::uint64_t reopened = 0;
    {
      std::lock_guard lock(mutex_);
      reopened = reopened_;
      find_steps(time, steps);
      for (OneLayer& layer : layers_) timed.push_back(layer.timed && layer.settings.enabled ? &layer : nullptr);
    }
    std::vector<Source> sources;
    for (std::size_t i = 0; i < timed.size(); ++i) sources.push_back(timed[i] ? source_of(*timed[i], steps[i]) : nullptr);
    std::lock_guard lock(mutex_);
    if (auto same = held(steps)) return same;
    bool complete = steps.size() == layers_.size() && reopened == reopened_;
    for (std::size_t i = 0; complete && i < timed.size(); ++i) complete = timed[i] || !layers_[i].timed || !layers_[i].settings.enabled;
    if (!complete) continue;  // layers have been added, switched on or reopened meanwhile
    auto description = describe(steps, sources);
    surfaces_.emplace_front(std::move(steps), description);
    if (surfaces_.size() > kHeldSurfaces) surfaces_.pop_back();
    return description;
  }
}

/// With the lock held. `sources` are those of layers with times.
std::shared_ptr<const surface::SurfaceDescription> SurfaceSteps::describe(const Steps& steps, const std::vector<Source>& sources) {
  auto description = std::make_shared<surface::SurfaceDescription>();
  description->ellipsoid = ellipsoid_;
  description->revision = ++last_revision_;
  for (const std::size_t i : order_) {
    const OneLayer& one = layers_[i];
    const Source& source = one.timed ? sources[i] : one.fixed;
    if (!one.settings.enabled || (!source && !one.catalogue)) continue;
    surface::Layer layer;
    layer.source = source;
    layer.catalogue = one.catalogue;
    layer.name = one.spec.name;
    layer.source_id = one.timed ? one.timed->ids.at(steps[i]) : one.id;
    layer.content = one.content;
    layer.opacity = static_cast<float>(one.settings.opacity);
    layer.gamma = static_cast<float>(one.settings.gamma);
    layer.multiplier = static_cast<float>(one.settings.multiplier);
    layer.feather = one.settings.feather;
    layer.adds = one.settings.adds;
    layer.use = use_of(one.spec.group);
    (one.spec.group == LayerGroup::height ? description->heights : description->colours).push_back(std::move(layer));
  }
  return description;
}

/// With the lock held. Frames ask for what is held: they must find it without opening anything. Held surfaces whose steps are not open any
/// more are forgotten.
void SurfaceSteps::describe_anew() {
  for (auto held = surfaces_.begin(); held != surfaces_.end();) {
    std::vector<Source> sources(layers_.size());
    bool open = true;
    for (std::size_t i = 0; i < layers_.size() && open; ++i) {
      const OneLayer& layer = layers_[i];
      if (!layer.timed || !layer.settings.enabled) continue;
      const auto found = std::ranges::find(layer.timed->open, held->first[i], [](const auto& entry) { return entry.first; });
      open = found != layer.timed->open.end();
      if (open) sources[i] = found->second;
    }
    if (open) {
      held->second = describe(held->first, sources);
      ++held;
    } else {
      held = surfaces_.erase(held);
    }
  }
}

void SurfaceSteps::set_catalogue(std::size_t layer, std::shared_ptr<const source::Catalogue> catalogue) {
  std::lock_guard lock(mutex_);
  if (layers_[layer].removed) return;
  layers_[layer].catalogue = std::move(catalogue);
  describe_anew();
}

void SurfaceSteps::set_source(std::size_t layer, std::shared_ptr<const source::RasterSource> source) {
  std::lock_guard lock(mutex_);
  OneLayer& one = layers_[layer];
  if (one.removed) return;
  if (one.fixed) ++one.content;
  one.fixed = std::move(source);
  describe_anew();
}

void SurfaceSteps::reopen_steps(std::size_t layer) {
  std::lock_guard lock(mutex_);
  OneLayer& one = layers_[layer];
  if (one.removed || !one.timed) return;
  ++one.content;
  ++reopened_;
  one.timed->open.clear();
  one.timed->failures = {};
  describe_anew();
}

void SurfaceSteps::set_settings(std::size_t layer, const LayerSettings& settings) {
  std::lock_guard lock(mutex_);
  if (layers_[layer].removed) return;
  layers_[layer].settings = settings;
  describe_anew();
}

bool SurfaceSteps::move(std::size_t layer, bool up) {
  std::lock_guard lock(mutex_);
  const auto here = std::ranges::find(order_, layer);
  if (here == order_.end()) return false;
  if (up ? std::next(here) == order_.end() : here == order_.begin()) return false;
  const auto other = up ? std::next(here) : std::prev(here);
  if (layers_[*other].spec.group != layers_[layer].spec.group) return false;
  std::swap(*here, *other);
  describe_anew();
  return true;
}

LayerSettings SurfaceSteps::settings(std::size_t layer) const {
  std::lock_guard lock(mutex_);
  return layers_[layer].settings;
}

std::vector<std::size_t> SurfaceSteps::order() const {
  std::lock_guard lock(mutex_);
  return order_;
}

std::shared_ptr<const source::RasterSource> SurfaceSteps::raster_at(std::size_t layer, const std::optional<UtcTime>& time) {
  OneLayer& one = layer_at(layer);
  if (one.timed) return settings(layer).enabled ? source_of(one, one.timed->times.step_at(time)) : nullptr;
  std::lock_guard lock(mutex_);
  return one.fixed;
}

std::string SurfaceSteps::text_of(std::size_t layer, const std::optional<UtcTime>& time) const {
  std::lock_guard lock(mutex_);
  const auto& timed = layers_[layer].timed;
  return timed ? timed->times.text(timed->times.step_at(time)) : std::string();
}

std::vector<std::uint32_t> SurfaceSteps::source_ids(std::size_t layer) const {
  std::lock_guard lock(mutex_);
  std::vector<std::uint32_t> ids{layers_[layer].id};
  if (const auto& timed = layers_[layer].timed) {
    for (const auto& [step, id] : timed->ids) ids.push_back(id);
  }
  if (const auto& catalogue = layers_[layer].catalogue) std::ranges::copy(catalogue->open_sets()->opened_ids(), std::back_inserter(ids));
  return ids;
}

SurfaceSteps::Failures SurfaceSteps::failures_of(std::size_t layer) const {
  std::lock_guard lock(mutex_);
  return layers_[layer].timed ? layers_[layer].timed->failures : Failures{};
}

}  // namespace tellurion::globe
