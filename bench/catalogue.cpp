// A catalogue of 10,000 rasters in five projections: its look-up, its opening, a frame over it, a raster put into it.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include <fmt/format.h>

#include "bench/groups.h"
#include "bench/scene.h"
#include "bench/statistics.h"
#include "geo/tile_key.h"
#include "source/catalogue/catalogue.h"
#include "surface/elevation_model.h"

namespace tellurion::bench {
namespace {

constexpr int kDataSets = 10'000;
constexpr int kSide = 256;                                     ///< pixels of a data set
constexpr double kFinest = 0.5, kCoarsest = 10e3;              ///< metres
constexpr std::array<const char*, 5> kProjections{"longlat", "tmerc", "stere", "sinu", "merc"};

struct Body {
  const char* name;
  geo::Ellipsoid ellipsoid;
};

/// A raster as a VRT: pixels of the default world's picture, put somewhere.
struct Placed {
  double latitude = 0, longitude = 0;  ///< degrees, of the middle
  double spacing = 1;                  ///< metres
  int width = kSide, height = kSide;
  int column = 0, row = 0;             ///< of the picture
  std::string_view projection = kProjections.front();
};

std::string vrt_text(const Placed& at, const geo::Ellipsoid& body, const std::string& picture) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const double a = body.a(), latitude = at.latitude * kDegree;
  // Roughly: where exactly it lies does not matter.
  std::string more = fmt::format(" +lon_0={}", at.longitude);
  double x = 0, y = 0, step = at.spacing;
  if (at.projection == "longlat") {
    more.clear();
    x = at.longitude;
    y = at.latitude;
    step /= a * kDegree;
  } else if (at.projection == "sinu") {
    y = a * latitude;
  } else if (at.projection == "merc") {
    y = a * std::asinh(std::tan(latitude));
    step /= std::cos(latitude);
  } else {
    more += fmt::format(" +lat_0={}", at.latitude);
  }
  std::string text = fmt::format("<VRTDataset rasterXSize=\"{}\" rasterYSize=\"{}\"><SRS>+proj={} +a={} +b={}{} +no_defs</SRS><GeoTransform>{:.12g},{:.12g},0,{:.12g},0,{:.12g}</GeoTransform>",
                                 at.width, at.height, at.projection, a, body.b(), more, x - at.width / 2.0 * step, step, y + at.height / 2.0 * step, -step);
  for (int band = 1; band <= 3; ++band) {
    text += fmt::format("<VRTRasterBand dataType=\"Byte\" band=\"{0}\"><SimpleSource><SourceFilename>{1}</SourceFilename><SourceBand>{0}</SourceBand>"
                        "<SrcRect xOff=\"{2}\" yOff=\"{3}\" xSize=\"{4}\" ySize=\"{5}\"/><DstRect xOff=\"0\" yOff=\"0\" xSize=\"{4}\" ySize=\"{5}\"/></SimpleSource></VRTRasterBand>",
                        band, picture, at.column, at.row, at.width, at.height);
  }
  return text + "</VRTDataset>\n";
}

/// The data sets of one body, and a place that one of 30 m covers, over all others where the list decides.
class Files {
 public:
  static constexpr double kPlace[2] = {40.0, 20.0};  ///< degrees

  static Result<Files> write(const Setting& setting, const Body& body) {
    auto earth = globe::resolve_world("");
    if (!earth) return earth.error();
    const auto colours = std::ranges::find(earth->layers, globe::LayerGroup::color, &globe::LayerSpec::group);
    if (colours == earth->layers.end()) return Error{ErrorCode::not_found, "the default world has no colours"};
    Files files;
    files.picture_ = std::filesystem::absolute(colours->source.path).string();
    files.folder_ = setting.scratch / body.name;
    std::filesystem::create_directories(files.folder_);
    std::mt19937_64 random(20260101);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
    for (int i = 0; i < kDataSets; ++i) {
      Placed at;
      at.latitude = std::asin(between(-0.98, 0.98)) * 180.0 / std::numbers::pi;
      at.longitude = between(-180.0, 180.0);
      at.spacing = kFinest * std::pow(kCoarsest / kFinest, between(0.0, 1.0));
      // Of a smaller body the widest would be more than a hemisphere.
      at.spacing *= body.ellipsoid.a() / geo::kWgs84.a();
      at.column = static_cast<int>(between(0.0, 4096 - kSide));
      at.row = static_cast<int>(between(0.0, 2048 - kSide));
      at.projection = kProjections[static_cast<std::size_t>(i) % kProjections.size()];
      files.add(fmt::format("{:05}", i), at, body);
    }
    files.add("cover", {kPlace[0], kPlace[1], 30.0, 4096, 2048, 0, 0, "stere"}, body);
    files.cover_ = files.paths_.back();
    return files;
  }

  std::string add(const std::string& name, const Placed& at, const Body& body) {
    const std::string path = (folder_ / (name + ".vrt")).string();
    std::ofstream(path) << vrt_text(at, body.ellipsoid, picture_);
    paths_.push_back(path);
    return path;
  }

  globe::World world(const Body& body, const std::vector<std::string>& paths) const {
    globe::World world;
    world.planet = body.name;
    world.ellipsoid = body.ellipsoid;
    globe::LayerSpec layer;
    layer.name = "Data sets";
    layer.source.type = "catalogue";
    layer.source.catalogue.files = paths;
    layer.source.catalogue.order = "listed";
    world.layers.push_back(layer);
    return world;
  }

  const std::vector<std::string>& all() const { return paths_; }
  const std::string& cover() const { return cover_; }

 private:
  std::filesystem::path folder_;
  std::string picture_, cover_;
  std::vector<std::string> paths_;
};

/// What a worker asks before it builds a tile's colours: tiles of all levels down to 15 under the data sets' middles.
void measure_lookup(const source::Catalogue& catalogue, Report& report) {
  std::vector<double> times;
  std::vector<std::uint32_t> found;
  std::size_t most = 0;
  std::mt19937_64 random(1);
  for (int i = 0; i < 20'000; ++i) {
    const auto& set = *catalogue.sets()[std::uniform_int_distribution<std::size_t>(0, catalogue.sets().size() - 1)(random)];
    const geo::TileKey key = geo::tile_at(geo::Vector<geo::Ecef>{set.footprint.cap().middle}, std::uniform_int_distribution<int>(0, 15)(random));
    const double texel = std::numbers::pi / 2.0 / std::ldexp(256.0, key.level);
    const CpuStopwatch watch;
    catalogue.find(source::region_of(key), Radians(surface::kNarrowestDataSet * texel), found);
    times.push_back(watch.seconds() * 1e6);
    most = std::max(most, found.size());
  }
  report.set("lookup_us", median(times), fmt::format("median of 20,000 tiles of levels 0 to 15, processor time; at most {} data sets found", most));
  report.set("lookup_us_p99", quantile(times, 0.99), "of the same");
}

/// A raster of 15 m put over what is shown, until a frame shows all of it.
Result<void> measure_insertion(Scene& scene, Files& files, const Body& body, Report& report) {
  const view::Camera camera = camera_at(scene, pose_at(Files::kPlace[0], Files::kPlace[1], 12e3, 0.0, -90.0));
  const std::string added = files.add("added", {Files::kPlace[0], Files::kPlace[1], 15.0, 1024, 1024, 512, 512, "tmerc"}, body);
  const std::size_t before = scene.globe->catalogue_of(0)->sets().size();
  const Stopwatch watch;
  if (auto inserted = scene.globe->insert(0, {added}); !inserted) return inserted;
  int frames = 0, frames_at_rest = 0;
  double known_ms = 0;
  do {
    scene.view->draw(camera, {});
    scene.thread->finish();
    ++frames;
    if (known_ms == 0 && scene.globe->catalogues_ready()) known_ms = watch.ms();
    frames_at_rest += known_ms != 0 && scene.view->parts_in_work() == 0;
    if (watch.seconds() > 60.0) return {ErrorCode::unavailable, "a raster put into the catalogue did not show within a minute"};
  } while (!scene.view->stats().complete);
  if (scene.globe->catalogue_of(0)->sets().size() != before + 1) return {ErrorCode::internal, "the raster is not in the catalogue"};
  report.set("insertion_ms", watch.ms(), fmt::format("{} frames; known after {:.0f} ms, the rest is reading and composing what it touches", frames, known_ms));
  report.set("insertion_frames", frames_at_rest, "of those: frames in which no worker read or composed any of it");
  return {};
}

Result<void> measure_catalogue(const Setting& setting, const Body& body, Report& report) {
  auto files = Files::write(setting, body);
  if (!files) return files.error();
  globe::GlobeOptions options;
  options.cache_folder = setting.scratch / "tables";  // that of open_scene
  {
    const Stopwatch watch;
    auto globe = globe::Globe::open(files->world(body, files->all()), options);
    if (!globe) return globe.error();
    report.set("first_open_s", watch.seconds(), "nothing known of any data set");
    if (!(*globe)->wait_for_catalogues(std::chrono::steady_clock::now() + std::chrono::minutes(10)) || (*globe)->data_missing())
      return {ErrorCode::internal, fmt::format("{} was not looked into", body.name)};
    report.set("look_into_s", watch.seconds(), fmt::format("all {}, by the workers, once", files->all().size()));
  }
  {
    const Stopwatch watch;
    auto globe = globe::Globe::open(files->world(body, files->all()), options);
    if (!globe) return globe.error();
    report.set("open_s", watch.seconds(), "with what the cache folder knows");
    if (!(*globe)->catalogues_ready()) return {ErrorCode::internal, "footprints were not kept"};
    measure_lookup(*(*globe)->catalogue_of(0), report);
  }
  auto many = open_scene(files->world(body, files->all()), setting);
  if (!many) return many.error();
  auto one = open_scene(files->world(body, {files->cover()}), setting);
  if (!one) return one.error();
  const view::Camera camera = camera_at(*many, pose_at(Files::kPlace[0], Files::kPlace[1], 12e3, 0.0, -90.0));
  const auto ratio = frame_ratio(*many, *one, camera, setting.quick);
  if (!ratio) return ratio.error();
  report.set("frame_ratio", ratio->value, ratio->note);
  return measure_insertion(*many, *files, body, report);
}

}  // namespace

std::vector<Benchmark> catalogue_benchmarks() {
  static constexpr std::array<Body, 3> kBodies{{{"earth", geo::kWgs84}, {"moon", geo::kMoon}, {"mars", geo::kMars}}};
  std::vector<Benchmark> benchmarks;
  for (const Body& body : kBodies) {
    benchmarks.push_back({fmt::format("catalogue.{}", body.name),
                          fmt::format("{} overlapping rasters of 0.5 m to 10 km (times the body's radius by the Earth's) in 5 projections as one layer", kDataSets),
                          {{"lookup_us", "us", 20.0},
                           {"lookup_us_p99", "us", {}},
                           {"first_open_s", "s", 2.0},
                           {"look_into_s", "s", {}},
                           {"open_s", "s", 2.0},
                           {"frame_ratio", "ratio", 1.05},
                           {"insertion_ms", "ms", {}},
                           {"insertion_frames", "frames", 2.0}},
                          [&body](const Setting& setting, Report& report) { return measure_catalogue(setting, body, report); }});
  }
  return benchmarks;
}

}  // namespace tellurion::bench
