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
    case LayerGroup::height:
    case LayerGroup::color:
    case LayerGroup::grayscale_overlay: break;
  }
  return surface::ImageUse::colour;
}

}  // namespace

SurfaceSteps::SurfaceSteps(const geo::Ellipsoid& ellipsoid, const std::vector<LayerInfo>& layers, OpenSource open)
    : ellipsoid_(ellipsoid), open_(std::move(open)), next_id_(static_cast<std::uint32_t>(layers.size())) {
  for (const LayerInfo& info : layers) {
    OneLayer layer{info.spec, {}, info.raster, info.catalogue, info.spec};
    if (info.spec.source.time) {
      if (auto times = source::TimeSteps::create(*info.spec.source.time)) layer.timed = TimedLayer{std::move(*times), {}, {}, {}};
      has_times_ = has_times_ || layer.timed.has_value();
    }
    order_.push_back(layers_.size());
    layers_.push_back(std::move(layer));
  }
  // Groups draw in their order, whatever the file's.
  std::ranges::stable_sort(order_, {}, [&](std::size_t i) { return layers_[i].spec.group; });
}

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
  {
    std::lock_guard lock(mutex_);
    if (const auto source = find()) return *source;
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
  if (auto same = held_at(time)) return same;
  Steps steps;
  find_steps(time, steps);
  std::vector<Source> sources;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    sources.push_back(layers_[i].timed && settings(i).enabled ? source_of(layers_[i], steps[i]) : nullptr);
  }
  std::lock_guard lock(mutex_);
  if (auto same = held(steps)) return same;
  auto description = describe(steps, sources);
  surfaces_.emplace_front(std::move(steps), description);
  if (surfaces_.size() > kHeldSurfaces) surfaces_.pop_back();
  return description;
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
    layer.source_id = one.timed ? one.timed->ids.at(steps[i]) : static_cast<std::uint32_t>(i);
    layer.opacity = static_cast<float>(one.settings.opacity);
    layer.gamma = static_cast<float>(one.settings.gamma);
    layer.multiplier = static_cast<float>(one.settings.multiplier);
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
  layers_[layer].catalogue = std::move(catalogue);
  describe_anew();
}

void SurfaceSteps::set_source(std::size_t layer, std::shared_ptr<const source::RasterSource> source) {
  std::lock_guard lock(mutex_);
  layers_[layer].fixed = std::move(source);
  describe_anew();
}

void SurfaceSteps::set_settings(std::size_t layer, const LayerSettings& settings) {
  std::lock_guard lock(mutex_);
  layers_[layer].settings = settings;
  describe_anew();
}

bool SurfaceSteps::move(std::size_t layer, bool up) {
  std::lock_guard lock(mutex_);
  const auto here = std::ranges::find(order_, layer);
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
  OneLayer& one = layers_[layer];
  if (one.timed) return settings(layer).enabled ? source_of(one, one.timed->times.step_at(time)) : nullptr;
  std::lock_guard lock(mutex_);
  return one.fixed;
}

std::string SurfaceSteps::text_of(std::size_t layer, const std::optional<UtcTime>& time) const {
  const auto& timed = layers_[layer].timed;
  return timed ? timed->times.text(timed->times.step_at(time)) : std::string();
}

std::vector<std::uint32_t> SurfaceSteps::source_ids(std::size_t layer) const {
  std::vector<std::uint32_t> ids{static_cast<std::uint32_t>(layer)};
  std::lock_guard lock(mutex_);
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
