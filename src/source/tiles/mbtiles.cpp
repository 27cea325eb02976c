// MBTiles archives. Their rows count from the south.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "source/tiles/archive_tile.h"
#include "source/tiles/height_decoders.h"
#include "source/tiles/sqlite_archive.h"
#include "source/tiles/tile_archive.h"
#include "source/tiles/tile_pyramid.h"

namespace tellurion::source {
namespace {

class Mbtiles final : public TileSupply {
 public:
  explicit Mbtiles(std::shared_ptr<const SqliteArchive> database) : database_(std::move(database)) {}

  fetch::Asked ask(const TileAddress& tile, const TileWish&) const override {
    const std::int64_t row = (std::int64_t{1} << tile.zoom) - 1 - tile.row;
    auto found = database_->rows("SELECT tile_data FROM tiles WHERE zoom_level = ? AND tile_column = ? AND tile_row = ?",
                                 {std::int64_t{tile.zoom}, tile.column, row}, 1);
    if (!found) return found.error();
    if (found->empty()) return fetch::File{};
    return fetch::File{std::make_shared<const std::string>(text_of(found->front().front())), {}, {}};
  }
  void reject(const TileAddress&, const std::string&) const override {}  // a file is what it is
  std::string name_of(const TileAddress& tile) const override {
    return fmt::format("{}, tile of zoom {}, column {}, row {} from the north", database_->name(), tile.zoom, tile.column, tile.row);
  }

 private:
  std::shared_ptr<const SqliteArchive> database_;
};

/// `bounds` of the metadata: "west,south,east,north"; nothing if they are not, or hold nothing.
std::optional<std::array<double, 4>> bounds_in(std::string_view text) {
  std::array<double, 4> bounds{};
  for (std::size_t i = 0; i < 4; ++i) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), bounds[i]);
    if (failure != std::errc() || !std::isfinite(bounds[i])) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (text.starts_with(',')) text.remove_prefix(1);
  }
  for (double& edge : bounds) edge = std::clamp(edge, -180.0, 180.0);
  return bounds[0] < bounds[2] && bounds[1] < bounds[3] ? std::optional(bounds) : std::nullopt;
}

/// A value of the table `metadata`; empty: it has none.
std::string said(const SqliteArchive& database, const char* name) {
  const auto found = database.rows("SELECT value FROM metadata WHERE name = ?", {std::string(name)}, 1);
  if (!found || found->empty()) return {};
  const SqlValue& value = found->front().front();
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return std::to_string(*whole);
  return text_of(value);
}

/// The coarsest and the finest zoom of the tiles; by the metadata where to look for them takes too long.
Result<std::pair<int, int>> zooms_of(const SqliteArchive& database) {
  std::array<std::int64_t, 2> zooms{};
  const std::array<const char*, 2> ends{"MIN", "MAX"}, names{"minzoom", "maxzoom"};
  for (std::size_t i = 0; i < 2; ++i) {
    const auto found = database.rows(fmt::format("SELECT {}(zoom_level) FROM tiles", ends[i]), {}, 1);
    if (found && !found->empty()) {
      zooms[i] = whole_of(found->front().front(), -1);
    } else {
      const std::string text = said(database, names[i]);
      if (text.empty()) return found ? Error{ErrorCode::corrupt, database.name()} : found.error();
      zooms[i] = whole_of(text, -1);
    }
  }
  if (zooms[0] < 0 || zooms[1] < zooms[0] || zooms[1] > 30)
    return Error{ErrorCode::corrupt, fmt::format("{}: holds no tiles, or of impossible zooms", database.name())};
  return std::pair(static_cast<int>(zooms[0]), static_cast<int>(zooms[1]));
}

}  // namespace

Result<std::unique_ptr<RasterSource>> open_mbtiles(const TileArchive& archive, const geo::Ellipsoid& world) {
  Result<std::unique_ptr<SqliteArchive>> opened = SqliteArchive::open(archive.file);
  if (!opened) return opened.error();
  const std::shared_ptr<const SqliteArchive> database = std::move(*opened);
  const std::string& name = database->name();
  if (!database->has_table("tiles")) return Error{ErrorCode::unsupported, fmt::format("{}: has no table of tiles: it is no MBTiles archive", name)};
  const std::string format = said(*database, "format");
  if (format == "pbf" || format == "mvt")
    return Error{ErrorCode::unsupported, fmt::format("{}: holds vector tiles ({}), which are not drawn; pictures or heights are needed", name, format)};
  const Result<std::pair<int, int>> zooms = zooms_of(*database);
  if (!zooms) return zooms.error();
  const auto sample = database->rows("SELECT tile_data FROM tiles WHERE zoom_level = ? LIMIT 1", {std::int64_t{zooms->first}}, 1);
  if (!sample) return sample.error();
  if (sample->empty()) return Error{ErrorCode::corrupt, fmt::format("{}: holds no tiles", name)};
  const Result<int> side = side_of_tile(text_of(sample->front().front()), name);
  if (!side) return side.error();
  Result<TileGrid> grid = web_mercator_grid(*side, zooms->first, std::max(zooms->first, std::min(zooms->second, deepest_zoom(*side))));
  if (!grid) return Error{grid.error().code, fmt::format("{}: {}", name, grid.error().message)};

  TilePyramid pyramid;
  pyramid.name = name;
  pyramid.revision = database->revision();
  pyramid.grid = std::move(*grid);
  pyramid.kind = archive.kind;
  pyramid.decode_heights = height_decoder(archive.encoding, pyramid.grid);
  pyramid.encoding = archive.encoding;
  pyramid.bounds = archive.bounds ? archive.bounds : bounds_in(said(*database, "bounds"));
  pyramid.vertical = archive.vertical;
  pyramid.is_remote = false;
  pyramid.attribution = said(*database, "attribution");
  pyramid.supply = std::make_shared<const Mbtiles>(database);
  return open_pyramid(std::move(pyramid), world);
}

}  // namespace tellurion::source
