#include "surface/prepared_table.h"

#include <cstddef>
#include <fstream>
#include <numbers>
#include <system_error>

#include <fmt/format.h>

#include "base/hash.h"
#include "surface/error_scan.h"
#include "surface/tile_content.h"

namespace tellurion::surface {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBeginning = std::size_t{1} << 20;  ///< bytes of the raster that are looked at

}  // namespace

fs::path prepared_table_file(const fs::path& raster) { return fs::path(raster) += ".errors"; }

Result<std::string> prepared_revision(const source::RasterSource& raster, const geo::Ellipsoid& ellipsoid) {
  const source::RasterDescription& about = raster.description();
  std::error_code failure;
  const std::uintmax_t bytes = about.is_remote ? 0 : fs::file_size(about.name, failure);
  std::ifstream file(about.name, std::ios::binary);
  if (about.is_remote || failure || !file) return {ErrorCode::not_found, fmt::format("{}: no file on this machine", about.name)};
  std::string beginning(kBeginning, '\0');
  file.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  beginning.resize(static_cast<std::size_t>(file.gcount()));
  const auto degrees = [](Radians angle) { return angle.value * 180.0 / std::numbers::pi; };
  return fmt::format("{}, grid {}\n{:.3f} {:.3f}\n{} bytes, {:016x}\n{}, {}, {}, {} x {}, {:.6f} {:.6f} {:.6f} {:.6f}, above {}", kTableRules, kGridSide, ellipsoid.a(), ellipsoid.b(), bytes, fnv1a(beginning),
                     about.sample_type, about.encoding, about.crs_name, about.levels.front().width, about.levels.front().height, degrees(about.bounds.south), degrees(about.bounds.north),
                     degrees(about.bounds.west), degrees(about.bounds.east), about.vertical);
}

Result<ErrorTable> load_prepared_table(const source::RasterSource& raster, const geo::Ellipsoid& ellipsoid) {
  const fs::path file = prepared_table_file(raster.description().name);
  std::error_code failure;
  if (!fs::is_regular_file(file, failure)) return {ErrorCode::not_found, fmt::format("{}: no such file", file.string())};
  const Result<std::string> revision = prepared_revision(raster, ellipsoid);
  if (!revision) return revision.error();
  Result<ErrorTable> table = ErrorTable::load(file, *revision);
  if (!table) {
    return {ErrorCode::corrupt, fmt::format("{} is not used: it is damaged, or of other data than {} as it is read here; `tellurion ingest --error-table yes` makes it anew, or remove it",
                                            file.string(), raster.description().name)};
  }
  return table;
}

}  // namespace tellurion::surface
