// What a globe is made of, as text: the planet, its layers in order, their sources.
// Format: docs/world-file.md
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "source/temporal/time_steps.h"

namespace tellurion::source {
class RasterSource;
}

namespace tellurion::globe {

/// The groups in the order in which they are drawn.
enum class LayerGroup { height, normal, color, grayscale, grayscale_overlay, water, night, overlay };

/// The group's name in world files.
std::string_view name_of(LayerGroup group);
std::optional<LayerGroup> group_by_name(std::string_view name);

inline constexpr int kEveryLevel = 30;   ///< as SourceSpec::max_level of "cesium-terrain": all that the server says it has
inline constexpr int kTerrainSize = 128; ///< the usual SourceSpec::tile_size of "cesium-terrain"
/// What is asked of a WMTS, WMS or TMS: see source::ServiceOptions.
struct ServiceSpec {
  std::string layer;       ///< of WMS `layers`, with commas between them
  std::string style;       ///< likewise
  std::string matrix_set;
  std::string format;
  std::string version;
  std::map<std::string, std::string> dimensions;
  std::optional<bool> transparent;
  std::optional<int> min_level;
  std::optional<int> max_level;
};

/// What a source of type "catalogue" holds.
struct CatalogueSpec {
  std::vector<std::string> files;  ///< absolute paths or URLs, besides what the list in SourceSpec::path names
  std::string order = "finest";    ///< which lies over which: the finer ones, or as "listed"
};

/// Where a layer's data come from. `path` is absolute once a world is loaded.
struct SourceSpec {
  std::string type = "gdal";
  std::filesystem::path path;
  std::optional<std::string> crs;
  std::optional<std::string> vertical;
  std::optional<double> no_data;
  std::optional<double> scale;
  std::optional<double> offset;
  std::optional<std::array<int, 3>> bands;  ///< red, green, blue; 1-based

  std::optional<source::TimeSpec> time;     ///< of {time} in `path` or `url`
  std::string unit = "km";                  ///< of type "scale": or "m"

  // Of sources on servers ("xyz", "cesium-terrain", "cog", "pmtiles", some of "tile-index"); there `path` is empty.
  std::string url;                          ///< see source::TileTemplate; or of a layer.json, or the file
  std::vector<std::string> subdomains;
  std::map<std::string, std::string> headers;
  std::string projection = "web-mercator";  ///< or "geographic"
  std::string encoding;                     ///< of heights: see source::height_decoder; empty: the first band's numbers
  int tile_size = 256;
  int min_level = 0;
  int max_level = 18;
  std::optional<std::array<double, 4>> bounds;  ///< west, south, east, north in degrees; of type "image" too
  std::string table;                        ///< of a GeoPackage; empty: the only one

  std::shared_ptr<const source::RasterSource> raster;  ///< what an embedding program draws or reads itself: instead of all above

  ServiceSpec service;                      ///< of types "wmts", "wms" and "tms", which also have url, headers and the like

  CatalogueSpec catalogue;                  ///< of type "catalogue"; there `path`, if any, is a list: see source::list_rasters

  bool is_service() const { return type == "wmts" || type == "wms" || type == "tms"; }
};

/// The path, or the URL without what is secret in it; empty if there is neither.
std::string data_name(const SourceSpec& source);

inline constexpr double kLeastGamma = 0.01, kMostGamma = 100.0, kMostMultiplier = 1e6, kMostFeather = 1e5;

/// What of a layer may be changed while its world is open.
struct LayerSettings {
  double opacity = 1.0;     ///< 0 to 1
  double gamma = 1.0;       ///< kLeastGamma to kMostGamma
  double multiplier = 1.0;  ///< within +-kMostMultiplier
  double feather = 0.0;     ///< pixels of a raster over which it fades inwards from where its data end, to kMostFeather; heights do from its border only
  bool enabled = true;
  bool adds = false;        ///< height layers: added to the ones below instead of replacing them

  friend bool operator==(const LayerSettings&, const LayerSettings&) = default;
};

/// Errors: invalid_argument, naming the value that is out of its range.
Result<void> check(const LayerSettings& settings, LayerGroup group);

struct LayerSpec : LayerSettings {
  std::string name;
  LayerGroup group = LayerGroup::color;
  SourceSpec source;
  std::string attribution;  ///< whom to credit; empty: whom the source itself names
  int line = 0;        ///< where it stands in the world file; 0 if it does not
};

struct World {
  std::string planet = "Earth";
  geo::Ellipsoid ellipsoid = geo::kWgs84;
  std::vector<LayerSpec> layers;   ///< in each group the later lie over the earlier
  std::filesystem::path file;      ///< empty if it was not read from a world file
};

/// Reads a world file. Errors name the file and the line: not_found, corrupt (no TOML), invalid_argument (an unknown key,
/// a wrong type or value), unsupported (a source type that this build lacks).
Result<World> load_world(const std::filesystem::path& file);

/// The same from text; relative paths are taken from `folder`, errors name `name`.
Result<World> parse_world(std::string_view text, const std::filesystem::path& folder, const std::string& name);

/// The world as TOML; parse_world gives the same world back.
std::string to_toml(const World& world);

/// Writes `world` to `file`, whole or not at all. Errors: unavailable.
Result<void> save_world(const World& world, const std::filesystem::path& file);

/// The folder with the embedded default world: $TELLURION_DATA_DIR, else beside the program, else where it was built.
/// Errors: not_found, naming the places looked at.
Result<std::filesystem::path> default_data_folder();

/// What a command line's WORLD means: nothing is the default world, *.toml a world file, *.mbtiles, *.gpkg, *.pmtiles an archive of
/// tiles, a URL tiles, or a file of them, or a GeoTIFF on a server, by its ending; anything else a raster: shown on the
/// body that its CRS names, over the default world's layers if that is the Earth.
Result<World> resolve_world(const std::string& argument);

/// The world of one layer that shows `data`, on its own body: a raster, an archive, tiles or a GeoTIFF on a server, or all rasters of a
/// list (see source::list_rasters), as which a folder counts in any case. Errors: those of resolve_world and list_rasters;
/// invalid_argument (a world file, a list of nothing).
Result<World> world_of_data(const std::string& data, bool is_list = false);

/// The layer of such a world, for another one. Errors: invalid_argument (they are of different bodies).
Result<LayerSpec> layer_for(const World& world, const World& data);

}  // namespace tellurion::globe
