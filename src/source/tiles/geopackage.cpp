// Tiles and gridded heights in GeoPackages. Their rows count from the north.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "source/gdal/picture_file.h"
#include "source/grid_coverage.h"
#include "source/length_unit.h"
#include "source/proj/pixel_mapping.h"
#include "source/tiles/archive_tile.h"
#include "source/tiles/height_decoders.h"
#include "source/tiles/sqlite_archive.h"
#include "source/tiles/tile_archive.h"
#include "source/tiles/tile_pyramid.h"

namespace tellurion::source {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Metres of a picture's number: ((number * tile's scale + tile's offset) * scale + offset) * unit. A supply of gridded heights
/// puts the tile's two in front of the tile's bytes.
struct GriddedHeights {
  double scale = 1.0;
  double offset = 0.0;
  double unit = 1.0;   ///< metres
  double null = kNaN;  ///< the number that means "no data"
  std::vector<std::string> hints{};
};
using TileScale = std::array<double, 2>;  ///< scale, offset

struct TileTable {
  std::string name;
  std::array<double, 4> extent{};  ///< least x, least y, largest x, largest y of the contents; NaN where it is not said
  std::optional<GriddedHeights> heights;
};

class GeopackageTiles final : public TileSupply {
 public:
  GeopackageTiles(std::shared_ptr<const SqliteArchive> database, TileTable table, std::vector<std::int64_t> zooms)
      : database_(std::move(database)), table_(std::move(table)), zooms_(std::move(zooms)),
        find_tile_(fmt::format("SELECT tile_data, id FROM {} WHERE zoom_level = ? AND tile_column = ? AND tile_row = ?", sql_name(table_.name))) {}

  fetch::Asked ask(const TileAddress& tile, const TileWish&) const override {
    auto found = database_->rows(find_tile_, {zooms_[static_cast<std::size_t>(tile.zoom)], tile.column, tile.row}, 1);
    if (!found) return found.error();
    if (found->empty()) return fetch::File{};
    const SqlRow& row = found->front();
    std::string bytes = text_of(row[0]);
    if (table_.heights && !bytes.empty()) {
      const auto more = database_->rows("SELECT scale, \"offset\" FROM gpkg_2d_gridded_tile_ancillary WHERE tpudt_name = ? AND tpudt_id = ?", {table_.name, row[1]}, 1);
      if (!more) return more.error();
      const TileScale scale = more->empty() ? TileScale{1.0, 0.0} : TileScale{number_of(more->front()[0], 1.0), number_of(more->front()[1], 0.0)};
      bytes.insert(0, reinterpret_cast<const char*>(scale.data()), sizeof scale);
    }
    return fetch::File{std::make_shared<const std::string>(std::move(bytes)), {}, {}};
  }
  void reject(const TileAddress&, const std::string&) const override {}  // a file is what it is
  std::string name_of(const TileAddress& tile) const override {
    return fmt::format("{}, table {}, tile of zoom {}, column {}, row {}", database_->name(), table_.name, zooms_[static_cast<std::size_t>(tile.zoom)], tile.column, tile.row);
  }

 private:
  std::shared_ptr<const SqliteArchive> database_;
  TileTable table_;
  std::vector<std::int64_t> zooms_;  ///< of the package, by TileAddress::zoom
  std::string find_tile_;
};

/// See GriddedHeights.
Result<raster::HeightGrid> gridded_heights(const std::string& bytes, const GriddedHeights& heights) {
  TileScale tile{};
  if (bytes.size() < sizeof tile) return Error{ErrorCode::corrupt, "is no tile"};
  std::memcpy(tile.data(), bytes.data(), sizeof tile);
  Result<raster::HeightGrid> grid = decode_height_band(bytes.substr(sizeof tile), kLargestTile);
  if (!grid) return grid;
  for (float& metres : grid->metres) {
    const double number = metres;
    if (std::isnan(metres)) continue;
    metres = number == heights.null || number == static_cast<double>(static_cast<float>(heights.null))
                 ? raster::kNoHeight
                 : static_cast<float>(((number * tile[0] + tile[1]) * heights.scale + heights.offset) * heights.unit);
  }
  return grid;
}

/// What is said of the numbers in `table`. Errors: corrupt.
Result<GriddedHeights> heights_of(const SqliteArchive& database, const std::string& table) {
  const auto rows = database.rows("SELECT scale, \"offset\", data_null FROM gpkg_2d_gridded_coverage_ancillary WHERE tile_matrix_set_name = ?", {table}, 1);
  if (!rows) return rows.error();
  if (rows->empty()) return Error{ErrorCode::corrupt, fmt::format("{}: says nothing of the heights in its table {}", database.name(), table)};
  const SqlRow& row = rows->front();
  GriddedHeights heights{number_of(row[0], 1.0), number_of(row[1], 0.0), 1.0, number_of(row[2], kNaN)};
  // Columns that the first edition of the standard lacks.
  const auto more = database.rows("SELECT uom, grid_cell_encoding FROM gpkg_2d_gridded_coverage_ancillary WHERE tile_matrix_set_name = ?", {table}, 1);
  if (!more || more->empty()) return heights;
  const std::string name = text_of(more->front()[0]);
  const std::string unit = name.substr(name.find_last_of('/') + 1);  // of the URI of a definition the end
  if (const auto metres = metres_of_unit(unit)) heights.unit = *metres;
  else if (!unit.empty()) heights.hints.push_back(fmt::format("{} has heights in \"{}\", which is no length that is known: they are taken as metres.", database.name(), plain_text(name)));
  if (text_of(more->front()[1]) == "grid-value-is-corner")
    heights.hints.push_back(fmt::format("{} says that its heights are those of cells' corners; they are shown at cells' centres, half a sample off.", database.name()));
  return heights;
}

/// The table that is meant.
Result<TileTable> find_table(const SqliteArchive& database, const TileArchive& archive) {
  const std::string& name = database.name();
  if (!database.has_table("gpkg_contents")) return Error{ErrorCode::unsupported, fmt::format("{}: has no gpkg_contents: it is no GeoPackage", name)};
  auto rows = database.rows("SELECT table_name, data_type, min_x, min_y, max_x, max_y FROM gpkg_contents WHERE data_type IN ('tiles', '2d-gridded-coverage')", {}, 1000);
  if (!rows) return rows.error();
  if (rows->empty())
    return Error{ErrorCode::unsupported, fmt::format("{}: holds no tiles, only features or tables, which are not drawn", name)};
  std::sort(rows->begin(), rows->end(), [](const SqlRow& a, const SqlRow& b) { return text_of(a[0]) < text_of(b[0]); });
  std::vector<std::string> names;
  for (const SqlRow& row : *rows) names.push_back(text_of(row[0]));
  if (archive.table.empty() && rows->size() > 1)
    return Error{ErrorCode::invalid_argument, fmt::format("{}: has several tables of tiles; name one of them: table = \"{}\"", name, fmt::join(names, "\" or \""))};
  const auto found = archive.table.empty() ? names.begin() : std::find(names.begin(), names.end(), archive.table);
  if (found == names.end())
    return Error{ErrorCode::not_found, fmt::format("{}: has no tiles in a table \"{}\", but in {}", name, archive.table, fmt::join(names, ", "))};
  const SqlRow& row = (*rows)[static_cast<std::size_t>(found - names.begin())];
  TileTable table{*found, {}, std::nullopt};
  for (std::size_t i = 0; i < 4; ++i) table.extent[i] = number_of(row[2 + i], kNaN);
  if (text_of(row[1]) == "tiles") return table;
  if (archive.kind != SampleKind::height)
    return Error{ErrorCode::unsupported, fmt::format("{}: its table {} holds heights; show them as group = \"height\"", name, table.name)};
  Result<GriddedHeights> heights = heights_of(database, table.name);
  if (!heights) return heights.error();
  table.heights = std::move(*heights);
  return table;
}

/// What PROJ understands. Errors: unsupported (none is named).
Result<std::string> crs_of(const SqliteArchive& database, std::int64_t srs_id) {
  const auto rows = database.rows("SELECT organization, organization_coordsys_id, definition FROM gpkg_spatial_ref_sys WHERE srs_id = ?", {srs_id}, 1);
  if (!rows) return rows.error();
  std::string organization = rows->empty() ? std::string() : text_of(rows->front()[0]);
  std::transform(organization.begin(), organization.end(), organization.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  const std::int64_t number = rows->empty() ? 0 : whole_of(rows->front()[1], 0);
  const std::string definition = rows->empty() ? std::string() : text_of(rows->front()[2]);
  if (number > 0 && (organization == "EPSG" || organization == "ESRI" || organization == "IAU_2015")) return fmt::format("{}:{}", organization, number);
  if (srs_id > 0 && !definition.empty() && definition != "undefined") return definition;
  return Error{ErrorCode::unsupported, fmt::format("{}: does not say its coordinate system (srs_id {})", database.name(), srs_id)};
}

/// The grid, and the package's zooms of its levels.
Result<std::pair<TileGrid, std::vector<std::int64_t>>> grid_of(const SqliteArchive& database, const TileTable& table) {
  const auto corrupt = [&](const std::string& what) { return Error{ErrorCode::corrupt, fmt::format("{}: {}", database.name(), what)}; };
  const auto sets = database.rows("SELECT srs_id, min_x, max_y FROM gpkg_tile_matrix_set WHERE table_name = ?", {table.name}, 1);
  if (!sets) return sets.error();
  if (sets->empty()) return corrupt(fmt::format("has no gpkg_tile_matrix_set for its table {}", table.name));
  Result<std::string> crs = crs_of(database, whole_of(sets->front()[0], -1));
  if (!crs) return crs.error();
  const glm::dvec2 corner(number_of(sets->front()[1], kNaN), number_of(sets->front()[2], kNaN));
  auto rows = database.rows("SELECT zoom_level, matrix_width, matrix_height, tile_width, tile_height, pixel_x_size, pixel_y_size FROM gpkg_tile_matrix "
                            "WHERE table_name = ?", {table.name}, 1000);
  if (!rows) return rows.error();
  const auto coarseness = [](const SqlRow& row) { return std::pair(-number_of(row[5], 0.0), whole_of(row[0], -1)); };
  std::sort(rows->begin(), rows->end(), [&](const SqlRow& a, const SqlRow& b) { return coarseness(a) < coarseness(b); });
  rows->resize(std::min<std::size_t>(rows->size(), 64));
  TileGrid grid;
  grid.crs = std::move(*crs);
  std::vector<std::int64_t> zooms;
  for (const SqlRow& row : *rows) {
    const glm::dvec2 pixel(number_of(row[5], 0.0), number_of(row[6], 0.0));
    const std::int64_t columns = whole_of(row[1], 0), tile_rows = whole_of(row[2], 0), width = whole_of(row[3], 0), height = whole_of(row[4], 0);
    constexpr std::int64_t kMost = std::int64_t{1} << 31;
    const bool good = pixel.x > 0 && pixel.y > 0 && columns > 0 && columns <= kMost && tile_rows > 0 && tile_rows <= kMost && width > 0 && height > 0;
    if (!good || !std::isfinite(corner.x) || !std::isfinite(corner.y)) return corrupt(fmt::format("has an impossible tile matrix for its table {}", table.name));
    if (width > kLargestTile || height > kLargestTile)
      return Error{ErrorCode::unsupported, fmt::format("{}: has tiles of {} x {} pixels; at most {} on a side are read", database.name(), width, height, kLargestTile)};
    if (grid.levels.empty()) {
      grid.tile_width = static_cast<int>(width);
      grid.tile_height = static_cast<int>(height);
    } else if (width != grid.tile_width || height != grid.tile_height) {
      return Error{ErrorCode::unsupported, fmt::format("{}: has tiles of different sizes in table {}; gdal_translate -of GPKG makes equal ones", database.name(), table.name)};
    } else if (!(pixel.x < grid.levels.back().pixel.x && pixel.y < grid.levels.back().pixel.y)) {
      return corrupt(fmt::format("its zooms do not grow finer in table {}", table.name));
    }
    grid.levels.push_back({corner, pixel, columns, tile_rows});
    zooms.push_back(whole_of(row[0], -1));
  }
  if (grid.levels.empty()) return corrupt(fmt::format("has no gpkg_tile_matrix for its table {}", table.name));
  return std::pair(std::move(grid), std::move(zooms));
}

/// The extent of the contents in degrees; nothing if it is not said, or lies across the antimeridian.
std::optional<std::array<double, 4>> bounds_of_contents(const TileTable& table, const TileGrid& grid, const geo::Ellipsoid& world) {
  const auto [min_x, min_y, max_x, max_y] = table.extent;
  if (!(min_x < max_x && min_y < max_y)) return std::nullopt;
  // A raster of 256 x 256 pixels over the extent.
  constexpr int kSide = 256;
  Result<PixelMapping> mapping = PixelMapping::create({grid.crs, {min_x, (max_x - min_x) / kSide, 0, max_y, 0, -(max_y - min_y) / kSide}, kSide, kSide}, world);
  if (!mapping) return std::nullopt;
  const geo::GeodeticBounds found = source::bounds_of({glm::dvec2(0.0), glm::dvec2(kSide)}, [&](std::span<const glm::dvec2> pixels, std::span<geo::LatLon> places) {
    mapping->to_places(pixels, places);
  });
  const auto degrees = [](Radians angle) { return to_degrees(angle).value; };
  const std::array<double, 4> bounds{degrees(found.west), degrees(found.south), degrees(found.east), degrees(found.north)};
  const bool plain = bounds[0] >= -180.0 && bounds[2] <= 180.0 && bounds[0] < bounds[2] && bounds[1] < bounds[3];
  return plain ? std::optional(bounds) : std::nullopt;
}

}  // namespace

Result<std::unique_ptr<RasterSource>> open_geopackage(const TileArchive& archive, const geo::Ellipsoid& world) {
  Result<std::unique_ptr<SqliteArchive>> opened = SqliteArchive::open(archive.file);
  if (!opened) return opened.error();
  const std::shared_ptr<const SqliteArchive> database = std::move(*opened);
  Result<TileTable> table = find_table(*database, archive);
  if (!table) return table.error();
  auto grid = grid_of(*database, *table);
  if (!grid) return grid.error();

  TilePyramid pyramid;
  pyramid.name = database->name();
  pyramid.revision = fmt::format("{}|{}", database->revision(), table->name);
  pyramid.grid = std::move(grid->first);
  pyramid.kind = archive.kind;
  if (table->heights) {
    pyramid.sample_type = "Float32";
    pyramid.hints = table->heights->hints;
    pyramid.decode_heights = [heights = *table->heights](const std::string& bytes, const TileAddress&) { return gridded_heights(bytes, heights); };
  } else {
    pyramid.decode_heights = height_decoder(archive.encoding, pyramid.grid);
    pyramid.encoding = archive.encoding;
  }
  pyramid.bounds = archive.bounds ? archive.bounds : bounds_of_contents(*table, pyramid.grid, world);
  pyramid.vertical = archive.vertical;
  pyramid.is_remote = false;
  pyramid.supply = std::make_shared<const GeopackageTiles>(database, std::move(*table), std::move(grid->second));
  return open_pyramid(std::move(pyramid), world);
}

}  // namespace tellurion::source
