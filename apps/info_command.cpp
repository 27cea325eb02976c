// tellurion info: what is in a world or a data set.
#include "commands.h"

#include <chrono>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <numbers>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "options.h"

namespace tellurion::apps {
namespace {

std::string angle(Radians value) { return fmt::format("{:.6f}", to_degrees(value).value); }

constexpr double kManySamples = 25e6;

/// Of the samples, or why there are none.
void print_statistics(const globe::LayerInfo& layer, bool exact) {
  const auto statistics = globe::statistics_of(layer, exact ? INFINITY : kManySamples);
  if (!statistics) {
    fmt::print("  samples     {}\n", statistics.error().message);
    return;
  }
  constexpr const char* kColours[] = {"red", "green", "blue"};
  const bool is_height = layer.raster->description().kind == source::SampleKind::height;
  for (std::size_t i = 0; i < statistics->bands.size(); ++i) {
    const source::BandStatistics& band = statistics->bands[i];
    fmt::print("  {:<11} {:.6g} .. {:.6g}{}, mean {:.6g}, standard deviation {:.6g}\n", is_height ? "samples" : statistics->bands.size() > 1 ? kColours[i] : "grey",
               band.least, band.largest, is_height ? " m" : "", band.mean, band.deviation);
  }
  const bool is_remote = layer.raster->description().is_remote;
  const std::string of_level = statistics->level == 0 ? "" : fmt::format(" (all of this of level {}{})", statistics->level, is_remote ? "" : "; --exact reads level 0");
  fmt::print("  there       {:.4g} % of the samples{}\n", 100.0 * statistics->share_there, of_level);
}

void print_raster(const source::RasterDescription& raster) {
  fmt::print("  file        {}\n", raster.name);
  fmt::print("  size        {} x {} samples, {} band{} of {}\n", raster.levels.front().width, raster.levels.front().height,
             raster.band_count, raster.band_count == 1 ? "" : "s", raster.sample_type);
  if (!raster.encoding.empty()) fmt::print("  encoding    {}\n", raster.encoding);
  std::vector<std::string> levels;
  for (const auto& level : raster.levels) levels.push_back(fmt::format("{}x{}", level.width, level.height));
  fmt::print("  levels      {}\n", fmt::join(levels, " "));
  fmt::print("  CRS         {}\n", raster.crs_name);
  fmt::print("  ellipsoid   {:.3f} x {:.3f} m\n", raster.ellipsoid.a(), raster.ellipsoid.b());
  fmt::print("  latitudes   {} .. {}\n", angle(raster.bounds.south), angle(raster.bounds.north));
  fmt::print("  longitudes  {} .. {}{}\n", angle(raster.bounds.west), angle(raster.bounds.east),
             raster.bounds.east.value - raster.bounds.west.value > 2.0 * std::numbers::pi - 1e-3 ? " (all round)" : "");
  fmt::print("  spacing     {:.3f} m\n", raster.spacing.value);
  if (!raster.attribution.empty()) fmt::print("  credit      {}\n", raster.attribution);
  if (raster.kind == source::SampleKind::height)
    fmt::print("  heights     above {}{}\n", raster.vertical, raster.vertical_declared ? "" : " (not declared: taken as such)");
}

void print_catalogue(const globe::LayerSpec& layer, const globe::CatalogueFacts& facts) {
  const auto& source = layer.source;
  if (!source.path.empty()) fmt::print("  list        {}\n", source.path.string());
  if (!source.catalogue.files.empty()) fmt::print("  files       {}\n", source.catalogue.files.size());
  fmt::print("  rasters     {}, {} lie over the others\n", facts.rasters, source.catalogue.order == "finest" ? "finer ones" : "later ones");
  if (facts.rasters > 0) fmt::print("  spacing     {:.3f} .. {:.3f} m\n", facts.finest.value, facts.coarsest.value);
}

struct InfoOptions : Options {
  std::filesystem::path picture;
  bool exact = false;
};

/// Over the whole globe as it is by day, each raster that does not go round it.
Result<void> draw_picture(const InfoOptions& options, globe::World world, const globe::Globe& told) {
  auto footprints = globe::with_footprints(std::move(world), told);
  if (!footprints) return footprints.error();
  globe::GlobeOptions globe_options;
  globe_options.scan_heights = false;
  const auto globe = globe::Globe::open(std::move(footprints->world), globe_options);
  if (!globe) return globe.error();
  auto thread = gpu::RenderThread::headless(options.api);
  if (!thread) return thread.error();
  const auto view = globe::GlobeView::create(**globe, **thread, options.gpu_cache_bytes);
  if (!view) return view.error();
  constexpr double kHeight = 1.9;  // radii of the body: all of it in 45 degrees
  constexpr int kSide = 800;
  constexpr Degrees kFieldOfView{45.0};
  view::Pose pose;
  const geo::LatLon below = footprints->middle.value_or(geo::LatLon{});
  pose.position = {below.latitude, below.longitude, EllipsoidalHeight(kHeight * (*globe)->ellipsoid().a())};
  pose.pitch = Radians(-std::numbers::pi / 2.0);
  globe::ViewSettings settings;
  settings.lighting = false;
  settings.sse_px = 2.0;  // of what lies on the data, little is wanted
  const auto camera = view::make_camera((*globe)->ellipsoid(), pose, to_radians(kFieldOfView), kSide, kSide);
  const bool is_complete = (*view)->finish(camera, settings, std::chrono::steady_clock::now() + std::chrono::minutes(2));
  if (const auto written = globe::write_png(options.picture, (*view)->picture(camera, settings)); !written) return written;
  if (!is_complete) fmt::print(stderr, "tellurion: {} is written, but it is not complete\n", options.picture.string());
  return {};
}

int info(const InfoOptions& options) {
  auto world = globe::resolve_world(options.world);
  if (!world) return report(world.error());
  const globe::World shown = *world;
  // A raster is told for itself, without what it would be shown over.
  if (world->file.empty()) world->layers.erase(world->layers.begin(), world->layers.end() - 1);
  globe::GlobeOptions globe_options;
  globe_options.workers = 0;
  globe_options.scan_heights = false;
  const auto globe = globe::Globe::open(std::move(*world), globe_options);
  if (!globe) return report(globe.error());
  const globe::World& w = (*globe)->world();
  fmt::print("planet {}: {:.3f} x {:.3f} m\n", w.planet, w.ellipsoid.a(), w.ellipsoid.b());
  (void)(*globe)->wait_for_catalogues(std::chrono::steady_clock::time_point::max());
  for (std::size_t i = 0; i < (*globe)->layer_count(); ++i) {
    const globe::LayerInfo& layer = (*globe)->layer(i);
    fmt::print("layer {} ({}){}\n", layer.spec.name, name_of(layer.spec.group), layer.spec.enabled ? "" : ", off");
    if (layer.raster) {
      print_raster(layer.raster->description());
      print_statistics(layer, options.exact);
    } else if (const auto catalogue = globe::catalogue_facts(**globe, i)) {
      print_catalogue(layer.spec, *catalogue);
    } else {
      fmt::print("  file        {}\n", layer.spec.source.url.empty() ? layer.spec.source.path.string() : fetch::without_credentials(layer.spec.source.url));
    }
    if (!layer.error.empty()) fmt::print("  error       {}\n", layer.error);
  }
  for (const std::string& hint : (*globe)->hints()) fmt::print(stderr, "tellurion: {}\n", hint);
  for (const std::string& problem : (*globe)->problems()) fmt::print(stderr, "tellurion: {}\n", problem);
  if (!options.picture.empty()) {
    if (const auto drawn = draw_picture(options, shown, **globe); !drawn) return report(drawn.error());
  }
  return (*globe)->data_missing() ? kDataMissing : kDone;
}

}  // namespace

void add_info(CLI::App& app, Run& run) {
  auto options = std::make_shared<InfoOptions>();
  CLI::App* command = app.add_subcommand("info", "what is in a world file or a raster");
  add_world(*command, *options, false);
  command->add_flag("--exact", options->exact, "statistics of all samples, however many");
  command->add_option("--picture", options->picture, "also draw where it lies on the globe")->check(has_ending(".png"))->type_name("FILE.png");
  command->callback([options, &run] { run = [options] { return info(*options); }; });
}

}  // namespace tellurion::apps
