#include "prepare/gdal/output_errors.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/hash.h"
#include "cache/block_cache.h"
#include "geo/body.h"
#include "prepare/parallel.h"
#include "prepare/scan_file.h"
#include "source/gdal/gdal_source.h"
#include "source/gdal/raster_body.h"
#include "surface/error_scan.h"
#include "surface/prepared_table.h"
#include "surface/tile_grid.h"

namespace tellurion::prepare {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kModelBytes = std::size_t{24} << 20;  ///< of a worker: a file that GDAL has open, and what it samples
constexpr std::size_t kLeastBlocks = std::size_t{8} << 20;

/// The body of the world in which such a raster is shown.
geo::Ellipsoid world_of(const geo::Ellipsoid& own) {
  const geo::Body* body = geo::body_like(own);
  return body != nullptr && body->ellipsoid == geo::kWgs84 ? geo::kWgs84 : own;
}

fs::path scan_file(const fs::path& folder, const std::string& revision, const geo::TileKey& part) {
  return folder / fmt::format("errors-{:016x}-{}-{}-{}-{}.scan", fnv1a(revision), part.face, part.level, part.x, part.y);
}

/// Removes the parts of earlier outputs.
void remove_stale(const fs::path& folder, const std::string& revision) {
  const std::string wanted = fmt::format("errors-{:016x}-", fnv1a(revision));
  std::error_code error;
  std::vector<fs::path> stale;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("errors-") && name.ends_with(".scan") && !name.starts_with(wanted)) stale.push_back(entry.path());
  }
  for (const fs::path& file : stale) fs::remove(file, error);
}

class Measurement {
 public:
  Measurement(std::shared_ptr<const source::RasterSource> output, const geo::Ellipsoid& ellipsoid, fs::path folder, std::string revision, std::size_t block_bytes)
      : blocks_(block_bytes), folder_(std::move(folder)), revision_(std::move(revision)) {
    surface::SurfaceDescription description;
    description.ellipsoid = ellipsoid;
    surface::Layer layer;
    layer.source = std::move(output);
    description.heights.push_back(std::move(layer));
    surface_ = std::make_shared<const surface::SurfaceDescription>(std::move(description));
    for (const geo::TileKey& job : surface::scan_jobs()) jobs_.push_back(surface::parts_of_job(*surface_, job));
  }

  Result<void> scan(int workers, const IngestWatch& watch) {
    std::vector<geo::TileKey> wanted;
    for (const auto& parts : jobs_) {
      std::ranges::copy_if(parts, std::back_inserter(wanted), [&](const geo::TileKey& part) { return !load_scan(scan_file(folder_, revision_, part), part); });
    }
    IngestProgress progress;
    progress.measures = true;
    for (const geo::TileKey& part : wanted) progress.all_pixels += samples_under(part);
    std::vector<std::optional<surface::ElevationModel>> models(static_cast<std::size_t>(workers));
    std::mutex mutex;
    return for_each_item(static_cast<int>(wanted.size()), workers, [&](int worker, int item) -> Result<void> {
      auto& model = models[static_cast<std::size_t>(worker)];
      if (!model) {
        Result<surface::ElevationModel> opened = surface::ElevationModel::open(surface_, blocks_);
        if (!opened) return opened.error();
        model.emplace(std::move(*opened));
      }
      const geo::TileKey& part = wanted[static_cast<std::size_t>(item)];
      const Result<surface::PartScan> found = surface::scan_part(*model, part);
      if (!found) return found.error();
      if (Result<void> kept = save_scan(*found, scan_file(folder_, revision_, part)); !kept) return kept;
      const std::lock_guard lock(mutex);
      progress.pixels += samples_under(part);
      progress.bytes += samples_under(part) * sizeof(float);
      if (watch && !watch(progress)) return {ErrorCode::cancelled, "stopped; the same command goes on from there"};
      return {};
    });
  }

  Result<surface::ErrorTable> merged() const {
    const std::vector<geo::TileKey> roots = surface::scan_jobs();
    std::vector<surface::SubtreeScan> scans;
    for (std::size_t job = 0; job < roots.size(); ++job) {
      surface::JobMerge merge(roots[job]);
      for (const geo::TileKey& part : jobs_[job]) {
        const Result<surface::PartScan> scan = load_scan(scan_file(folder_, revision_, part), part);
        if (!scan) return scan.error();
        merge.add(*scan);
      }
      scans.push_back(std::move(merge).finish());
    }
    return surface::merge_scans(scans);
  }

 private:
  /// About so many: for the progress.
  std::uint64_t samples_under(const geo::TileKey& part) const {
    const surface::Layer& layer = surface_->heights.front();
    if (!layer.source->coverage().touches(part)) return 0;
    const double side = surface::nominal_tile_size(surface_->ellipsoid, part.level) / surface::finest_spacing(surface_->heights, part);
    return static_cast<std::uint64_t>(side * side);
  }

  std::shared_ptr<const surface::SurfaceDescription> surface_;
  cache::BlockCache blocks_;
  std::vector<std::vector<geo::TileKey>> jobs_;
  fs::path folder_;
  std::string revision_;
};

}  // namespace

Result<bool> make_error_table(const fs::path& out, const fs::path& folder, const ErrorTableOptions& options, const IngestWatch& watch) {
  const fs::path file = surface::prepared_table_file(out);
  std::error_code error;
  const bool is_asked_for = options.wanted.value_or(false);
  const auto unreadable = [&](const Error& why) { return is_asked_for ? Result<bool>(why) : Result<bool>(false); };  // other programs may well read it
  const Result<source::RasterBody> body = source::body_of_raster(out);
  if (!body) return unreadable(body.error());
  if (is_asked_for && body->kind == source::SampleKind::colour) return {ErrorCode::invalid_argument, fmt::format("{} is a picture: there are error tables of heights only; leave --error-table out", out.string())};
  const geo::Ellipsoid ellipsoid = world_of(body->ellipsoid);
  source::GdalOptions how;
  how.path = fs::absolute(out, error).lexically_normal().string();
  how.kind = is_asked_for ? source::SampleKind::height : body->kind;
  Result<std::unique_ptr<source::RasterSource>> opened = source::open_gdal(how, ellipsoid);
  if (!opened) return unreadable(opened.error());
  const std::shared_ptr<const source::RasterSource> output = std::move(*opened);
  const source::LevelSize& size = output->description().levels.front();
  const bool is_large = static_cast<double>(size.width) * size.height > surface::kMostScannedSamples;
  const bool is_there = surface::load_prepared_table(*output, ellipsoid).has_value();
  if (how.kind != source::SampleKind::height || !options.wanted.value_or(is_large)) {
    if (!is_there) fs::remove(file, error);
    return false;
  }
  if (is_there) return false;
  const Result<std::string> revision = surface::prepared_revision(*output, ellipsoid);
  if (!revision) return revision.error();
  fs::create_directories(folder, error);
  if (error) return {ErrorCode::unavailable, fmt::format("{} cannot be made: {}; is there a folder, and is it writable?", folder.string(), error.message())};

  const std::size_t gdal_bytes = std::max(options.memory_bytes / 8, kLeastBlocks), block_bytes = std::max(options.memory_bytes / 4, kLeastBlocks);
  source::configure_gdal(gdal_bytes);
  const std::size_t left = options.memory_bytes - std::min(options.memory_bytes, gdal_bytes + block_bytes);
  const int workers = std::max(1, static_cast<int>(std::min<std::size_t>(static_cast<std::size_t>(options.workers), left / kModelBytes)));
  Measurement measurement(output, ellipsoid, folder, *revision, block_bytes);
  if (Result<void> scanned = measurement.scan(workers, watch); !scanned) return scanned.error();
  const Result<surface::ErrorTable> table = measurement.merged();
  if (!table) return table.error();
  if (Result<void> saved = table->save(file, *revision); !saved) return saved.error();
  remove_stale(folder, *revision);
  return true;
}

}  // namespace tellurion::prepare
