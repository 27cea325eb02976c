// tellurion info: what is in a world or a data set.
#include "commands.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "options.h"

namespace tellurion::apps {
namespace {

std::string angle(Radians value) { return fmt::format("{:.6f}", to_degrees(value).value); }

void print_raster(const source::RasterDescription& raster) {
  fmt::print("  file        {}\n", raster.name);
  fmt::print("  size        {} x {} samples, {} band{} of {}\n", raster.levels.front().width, raster.levels.front().height,
             raster.band_count, raster.band_count == 1 ? "" : "s", raster.sample_type);
  std::vector<std::string> levels;
  for (const auto& level : raster.levels) levels.push_back(fmt::format("{}x{}", level.width, level.height));
  fmt::print("  levels      {}\n", fmt::join(levels, " "));
  fmt::print("  CRS         {}\n", raster.crs_name);
  fmt::print("  ellipsoid   {:.3f} x {:.3f} m\n", raster.ellipsoid.a(), raster.ellipsoid.b());
  fmt::print("  latitudes   {} .. {}\n", angle(raster.bounds.south), angle(raster.bounds.north));
  fmt::print("  longitudes  {} .. {}{}\n", angle(raster.bounds.west), angle(raster.bounds.east),
             raster.wraps ? " (all round)" : "");
  fmt::print("  spacing     {:.3f} m\n", raster.spacing.value);
  if (!raster.attribution.empty()) fmt::print("  credit      {}\n", raster.attribution);
  if (raster.kind == source::SampleKind::height)
    fmt::print("  heights     above {}{}\n", raster.vertical, raster.vertical_declared ? "" : " (not declared: taken as such)");
}

int info(const Options& options) {
  auto world = globe::resolve_world(options.world);
  if (!world) return report(world.error());
  // A raster is told for itself, without what it would be shown over.
  if (world->file.empty()) world->layers.erase(world->layers.begin(), world->layers.end() - 1);
  globe::GlobeOptions globe_options;
  globe_options.workers = 0;
  globe_options.scan_heights = false;
  const auto globe = globe::Globe::open(std::move(*world), globe_options);
  if (!globe) return report(globe.error());
  const globe::World& w = (*globe)->world();
  fmt::print("planet {}: {:.3f} x {:.3f} m\n", w.planet, w.ellipsoid.a(), w.ellipsoid.b());
  for (const globe::LayerInfo& layer : (*globe)->layers()) {
    fmt::print("layer {} ({}){}\n", layer.spec.name, name_of(layer.spec.group), layer.spec.enabled ? "" : ", off");
    if (layer.raster) print_raster(layer.raster->description());
    else fmt::print("  file        {}\n", layer.spec.source.url.empty() ? layer.spec.source.path.string() : fetch::without_credentials(layer.spec.source.url));
    if (!layer.error.empty()) fmt::print("  error       {}\n", layer.error);
  }
  for (const std::string& hint : (*globe)->hints()) fmt::print(stderr, "tellurion: {}\n", hint);
  return (*globe)->data_missing() ? kDataMissing : kDone;
}

}  // namespace

void add_info(CLI::App& app, Run& run) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("info", "what is in a world file or a raster");
  add_world(*command, *options, false);
  command->callback([options, &run] { run = [options] { return info(*options); }; });
}

}  // namespace tellurion::apps
