// What layers over one another cost a frame once they are composed.
#include <fmt/format.h>

#include "bench/groups.h"
#include "bench/scene.h"
#include "bench/statistics.h"

namespace tellurion::bench {
namespace {

constexpr const char* kMay = "earth/imagery/bmng_200405_2048.jpg";
constexpr const char* kClouds = "earth/imagery/clouds_4096.png";
constexpr std::size_t kLayers = 12;

Result<void> measure_twelve(const Setting& setting, Report& report) {
  const auto colour = globe::LayerGroup::color;
  auto one = world_of(setting, {{globe::LayerGroup::height, kEtopo5}, {globe::LayerGroup::height, kRainier}, {colour, kLargeBlueMarble}});
  if (!one) return one.error();
  auto more = world_of(setting, {{colour, kBlueMarble}, {colour, kMay}, {colour, kClouds}});
  if (!more) return more.error();
  globe::World twelve = *one;
  for (std::size_t i = 1; i < kLayers; ++i) {
    globe::LayerSpec layer = more->layers[i % more->layers.size()];
    layer.name += fmt::format(" {}", i);
    layer.opacity = 0.5;
    layer.gamma = i % 2 == 0 ? 1.2 : 0.9;
    twelve.layers.push_back(std::move(layer));
  }
  auto with_twelve = open_scene(std::move(twelve), setting);
  if (!with_twelve) return with_twelve.error();
  auto with_one = open_scene(std::move(*one), setting);
  if (!with_one) return with_one.error();
  const view::Camera camera = camera_at(*with_one, pose_at(46.70, -121.76, 6500.0, 0.0, -10.0));
  const auto ratio = frame_ratio(*with_twelve, *with_one, camera, setting.quick);
  if (!ratio) return ratio.error();
  report.set("frame_ratio", ratio->value, ratio->note);
  return {};
}

}  // namespace

std::vector<Benchmark> layer_benchmarks() {
  return {{"layers.twelve",
           "finished view of Mt Rainier with 12 colour layers, 11 of them half transparent and with a gamma, over one with a single colour layer",
           {{"frame_ratio", "ratio", 1.1}},
           measure_twelve}};
}

}  // namespace tellurion::bench
