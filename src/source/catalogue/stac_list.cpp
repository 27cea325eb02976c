#include "source/catalogue/stac_list.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "source/catalogue/list_maker.h"

namespace tellurion::source {
namespace {

using Json = nlohmann::ordered_json;  // "the first asset" is the first written

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kTurnDegrees = 360.0;
constexpr double kCoarsestSpacing = 1e7;  ///< metres; what is coarser is an error

// --- Items out of the text -------------------------------------------------------------------------------------------

/// Builds one JSON value at a time: each feature of the outermost object's `features` goes to `take` and is forgotten, all else stays in
/// `root`.
class ItemReader final : public nlohmann::json_sax<Json> {
 public:
  using Take = std::function<bool(const Json& feature)>;  ///< false: enough
  explicit ItemReader(Take take) : take_(std::move(take)) {}

  Json root;
  bool has_features = false;
  std::optional<Error> error;

  bool null() override { return add_whole(nullptr); }
  bool boolean(bool value) override { return add_whole(value); }
  bool number_integer(number_integer_t value) override { return add_whole(value); }
  bool number_unsigned(number_unsigned_t value) override { return add_whole(value); }
  bool number_float(number_float_t value, const string_t&) override { return add_whole(value); }
  bool string(string_t& value) override { return add_whole(std::move(value)); }
  bool binary(binary_t&) override { return false; }
  bool key(string_t& value) override {
    key_ = std::move(value);
    return true;
  }
  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override {
    if (open_.size() == 1 && open_.front()->is_object() && key_ == "features") {
      has_features = true;
      if (!open(Json::array())) return false;
      features_ = open_.back();
      return true;
    }
    return open(Json::array());
  }
  bool end_object() override { return close(); }
  bool end_array() override {
    if (open_.back() == features_) features_ = nullptr;
    return close();
  }
  bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception&) override {
    error = Error{ErrorCode::corrupt, fmt::format("is no valid JSON, from byte {} on", position)};
    return false;
  }

 private:
  static constexpr std::size_t kDeepest = 64;
  static constexpr std::size_t kMostValues = 2'000'000;  ///< of an item

  bool is_in_features() const { return features_ != nullptr && open_.back() == features_; }

  bool fail(ErrorCode code, std::string what) {
    error = Error{code, std::move(what)};
    return false;
  }

  Json* add(Json value) {
    if (++values_ > kMostValues) {
      fail(ErrorCode::exhausted, fmt::format("has an item of more than {} values", kMostValues));
      return nullptr;
    }
    if (open_.empty()) return &(root = std::move(value));
    if (is_in_features()) return &(item_ = std::move(value));
    Json& parent = *open_.back();
    if (parent.is_array()) {
      parent.push_back(std::move(value));
      return &parent.back();
    }
    // Without looking whether the object has the key: of two the first is found.
    auto& members = static_cast<Json::object_t::Container&>(parent.get_ref<Json::object_t&>());
    return &members.emplace_back(std::move(key_), std::move(value)).second;
  }

  /// A value that holds no others.
  bool add_whole(Json value) { return add(std::move(value)) != nullptr && (open_.empty() || !is_in_features() || hand_over()); }

  bool hand_over() {
    const bool more = take_(item_);
    item_ = nullptr;
    return more;
  }

  bool open(Json value) {
    if (open_.size() >= kDeepest) return fail(ErrorCode::corrupt, fmt::format("is nested more than {} deep, which no STAC item is", kDeepest));
    const bool is_item = !open_.empty() && is_in_features();
    const std::size_t before = values_;
    Json* made = add(std::move(value));
    if (made == nullptr) return false;
    if (is_item) values_outside_ = before;
    open_.push_back(made);
    return true;
  }

  bool close() {
    open_.pop_back();
    if (open_.empty() || !is_in_features()) return true;
    values_ = values_outside_;
    return hand_over();
  }

  Take take_;
  std::vector<Json*> open_;     ///< objects and arrays that have not ended, outermost first; none moves while one in it is open
  Json* features_ = nullptr;    ///< of them
  Json item_;
  string_t key_;
  std::size_t values_ = 0;
  std::size_t values_outside_ = 0;  ///< before the item began
};

// --- Members ---------------------------------------------------------------------------------------------------------

/// Nothing if `table` is no object, or lacks it.
const Json* member(const Json& table, const char* key) {
  if (!table.is_object()) return nullptr;
  const auto found = table.find(key);
  return found != table.end() ? &*found : nullptr;
}

std::string text_of(const Json& table, const char* key) {
  const Json* found = member(table, key);
  return found != nullptr && found->is_string() ? found->get<std::string>() : std::string();
}

std::optional<double> number_of(const Json& value) {
  if (!value.is_number()) return std::nullopt;
  const double number = value.get<double>();
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// --- Where it lies ---------------------------------------------------------------------------------------------------

struct Box {
  double west = 0.0, south = 0.0, east = 0.0, north = 0.0;  ///< degrees; east may exceed 180
  bool crosses = false;                                     ///< the antimeridian
};

/// GeoJSON's bbox: of two or of three dimensions, west above east where it crosses the antimeridian.
std::optional<Box> box_of(const Json& item) {
  const Json* list = member(item, "bbox");
  if (list == nullptr || !list->is_array() || (list->size() != 4 && list->size() != 6)) return std::nullopt;
  const std::size_t half = list->size() / 2;
  const auto west = number_of((*list)[0]), south = number_of((*list)[1]), east = number_of((*list)[half]), north = number_of((*list)[half + 1]);
  if (!west || !south || !east || !north || *south > *north) return std::nullopt;
  const bool crosses = *west > *east;
  return Box{*west, *south, *east + (crosses ? kTurnDegrees : 0.0), *north, crosses};
}

/// The outer ring of a polygon's coordinates; nothing if they are none.
std::optional<Outline> outline_of(const Json& polygon) {
  if (!polygon.is_array() || polygon.empty() || !polygon.front().is_array()) return std::nullopt;
  Outline outline;
  for (const Json& position : polygon.front()) {
    if (!position.is_array() || position.size() < 2) return std::nullopt;
    const auto x = number_of(position[0]), y = number_of(position[1]);
    if (!x || !y) return std::nullopt;
    outline.push_back({*x, *y});
  }
  return outline;
}

std::optional<std::vector<Outline>> outlines_of(const Json& item) {
  const Json* geometry = member(item, "geometry");
  const Json* coordinates = geometry != nullptr ? member(*geometry, "coordinates") : nullptr;
  if (coordinates == nullptr) return std::nullopt;
  const std::string type = text_of(*geometry, "type");
  std::vector<Outline> outlines;
  if (type == "Polygon") {
    auto outline = outline_of(*coordinates);
    if (!outline) return std::nullopt;
    outlines.push_back(std::move(*outline));
    return outlines;
  }
  if (type != "MultiPolygon" || !coordinates->is_array()) return std::nullopt;
  for (const Json& polygon : *coordinates) {
    auto outline = outline_of(polygon);
    if (!outline) return std::nullopt;
    outlines.push_back(std::move(*outline));
  }
  return outlines;
}

/// Whether they are degrees; latitudes a little beyond a pole are the pole.
bool to_degrees(std::vector<glm::dvec2>& ring) {
  constexpr double kRounding = 1e-4, kFarthest = 2.0 * kTurnDegrees;
  for (glm::dvec2& p : ring) {
    if (!(std::abs(p.y) <= 90.0 + kRounding) || !(std::abs(p.x) <= kFarthest)) return false;
    p.y = std::clamp(p.y, -90.0, 90.0);
  }
  return true;
}

/// From the item's geometry, else its bbox; empty if neither can be used.
std::vector<geo::LatLon> ring_of(const Json& item, const geo::Ellipsoid& world) {
  // On flattened bodies but the Earth lists hold planetocentric latitudes as well as planetographic ones.
  const bool on_earth = std::abs(world.a() / geo::kWgs84.a() - 1.0) <= 0.01;
  if (!on_earth && world.a() != world.b()) return {};
  const std::optional<Box> box = box_of(item);
  std::vector<glm::dvec2> degrees;
  if (auto outlines = outlines_of(item)) {
    if (box && box->crosses && outlines->size() == 1) {  // then edges of more than half a turn cross, too
      Outline& outline = outlines->front();
      for (std::size_t i = 1; i < outline.size(); ++i) outline[i].x -= kTurnDegrees * std::round((outline[i].x - outline[i - 1].x) / kTurnDegrees);
    }
    degrees = ring_of_outlines(std::move(*outlines), kTurnDegrees);
    if (!to_degrees(degrees)) degrees.clear();
  }
  if (degrees.empty() && box) {
    degrees = ring_of_rectangle({box->west, box->south}, {box->east, box->north});
    if (!to_degrees(degrees)) degrees.clear();
  }
  std::vector<geo::LatLon> ring;
  ring.reserve(degrees.size());
  for (const glm::dvec2& p : degrees) ring.push_back({Radians(p.y * kDegree), Radians(p.x * kDegree)});
  return ring;
}

// --- How fine it is --------------------------------------------------------------------------------------------------

std::optional<double> spacing_in(const Json& table, const char* key) {
  const Json* found = member(table, key);
  const auto number = found != nullptr ? number_of(*found) : std::nullopt;
  return number && *number > 0.0 && *number <= kCoarsestSpacing ? number : std::nullopt;
}

/// The finest that the bands of an asset tell.
std::optional<double> spacing_of_bands(const Json& asset) {
  std::optional<double> finest = spacing_in(asset, "raster:spatial_resolution");
  for (const char* list : {"raster:bands", "bands"}) {
    const Json* bands = member(asset, list);
    if (bands == nullptr || !bands->is_array()) continue;
    for (const Json& band : *bands) {
      for (const char* key : {"spatial_resolution", "raster:spatial_resolution"}) {
        if (const auto told = spacing_in(band, key)) finest = std::min(finest.value_or(*told), *told);
      }
    }
  }
  return finest;
}

/// Of a CRS, by its code of the EPSG: 0 if it is not told.
std::int64_t epsg_of(const Json& table) {
  if (const Json* code = member(table, "proj:epsg"); code != nullptr && code->is_number_integer()) return code->get<std::int64_t>();
  const std::string name = text_of(table, "proj:code");
  if (!name.starts_with("EPSG:") || name.size() > 12) return 0;
  std::int64_t code = 0;
  for (const char c : name.substr(5)) {
    if (c < '0' || c > '9') return 0;
    code = 10 * code + (c - '0');
  }
  return code;
}

/// The larger side of a pixel on the Earth's ground at `latitude`, from an asset's affine transform. Of the CRSs whose units are known
/// without PROJ: those of UTM and of the web, and degrees.
std::optional<double> spacing_of_transform(const Json& asset, const Json& properties, Radians latitude) {
  const Json* transform = member(asset, "proj:transform");
  const Json& holder = transform != nullptr ? asset : properties;
  if (transform == nullptr) transform = member(properties, "proj:transform");
  if (transform == nullptr || !transform->is_array() || (transform->size() != 6 && transform->size() != 9)) return std::nullopt;
  std::array<double, 6> t{};
  for (std::size_t i = 0; i < t.size(); ++i) {
    const auto number = number_of((*transform)[i]);
    if (!number) return std::nullopt;
    t[i] = *number;
  }
  std::int64_t epsg = epsg_of(holder);
  if (epsg == 0) epsg = epsg_of(properties);
  const double shrinking = std::max(std::cos(latitude.value), 1e-3);
  double east = 0.0, north = 0.0;  // metres a unit
  if ((epsg > 32600 && epsg <= 32660) || (epsg > 32700 && epsg <= 32760)) east = north = 1.0;
  if (epsg == 3857) east = north = shrinking;
  if (epsg == 4326) {
    north = geo::kWgs84.a() * kDegree;
    east = north * shrinking;
  }
  const double spacing = std::max(std::hypot(t[0] * east, t[3] * north), std::hypot(t[1] * east, t[4] * north));
  return spacing > 0.0 && spacing <= kCoarsestSpacing ? std::optional(spacing) : std::nullopt;
}

/// 0 if it is not told.
Metres spacing_of(const Json& item, const Json& asset, std::span<const geo::LatLon> ring) {
  const Json none;
  const Json* found = member(item, "properties");
  const Json& properties = found != nullptr ? *found : none;
  std::optional<double> spacing = spacing_of_bands(asset);
  if (!spacing && !ring.empty()) {
    double south = ring.front().latitude.value, north = south;
    for (const geo::LatLon& place : ring) {
      south = std::min(south, place.latitude.value);
      north = std::max(north, place.latitude.value);
    }
    spacing = spacing_of_transform(asset, properties, Radians((south + north) / 2.0));
  }
  if (!spacing) spacing = spacing_in(asset, "gsd");
  if (!spacing) spacing = spacing_in(properties, "gsd");
  return Metres(spacing.value_or(0.0));
}

// --- Which file ------------------------------------------------------------------------------------------------------

bool has_role(const Json& asset, std::string_view role) {
  const Json* roles = member(asset, "roles");
  if (roles == nullptr || !roles->is_array()) return false;
  return std::any_of(roles->begin(), roles->end(), [&](const Json& r) { return r.is_string() && r.get_ref<const std::string&>() == role; });
}

bool is_raster(const Json& asset) {
  constexpr std::array<std::string_view, 22> kEndings{".tif", ".tiff", ".gtiff", ".jp2", ".j2k", ".jpg", ".jpeg", ".png", ".webp", ".vrt", ".img",
                                                      ".hgt", ".dt0", ".dt1", ".dt2", ".dem", ".asc", ".bil", ".nc", ".mrf", ".cub", ".sid"};
  std::string href = lower_case(text_of(asset, "href"));
  if (href.find("://") != std::string::npos) href.resize(std::min(href.find_first_of("?#"), href.size()));
  const bool ends = std::any_of(kEndings.begin(), kEndings.end(), [&](std::string_view ending) { return href.ends_with(ending); });
  return !href.empty() && (ends || text_of(asset, "type").starts_with("image/"));
}

/// The asset to show; nothing if none is a raster.
const Json* asset_of(const Json& item) {
  const Json* assets = member(item, "assets");
  if (assets == nullptr || !assets->is_object()) return nullptr;
  const Json* best = nullptr;
  int best_rank = 0;
  for (const auto& [key, asset] : assets->items()) {
    if (!asset.is_object() || !is_raster(asset) || key == "thumbnail" || has_role(asset, "thumbnail") || has_role(asset, "overview")) continue;
    const int rank = has_role(asset, "visual") ? 3 : has_role(asset, "data") ? 2 : 1;
    if (rank <= best_rank) continue;
    best = &asset;
    best_rank = rank;
  }
  return best;
}

int hex_digit(char c) { return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1; }

/// "%20" becomes a blank.
std::string unescaped(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const int high = text[i] == '%' && i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
    const int low = high >= 0 ? hex_digit(text[i + 2]) : -1;
    plain += low >= 0 ? static_cast<char>(16 * high + low) : text[i];
    if (low >= 0) i += 2;
  }
  return plain;
}

/// Nothing if it is no file and no URL that can be fetched.
std::optional<std::string> path_of(const std::string& href, const std::filesystem::path& folder) {
  if (href.find('\0') != std::string::npos) return std::nullopt;
  const std::size_t scheme = href.find("://");
  if (scheme == std::string::npos) return listed_path(href, folder);
  if (href.starts_with("http://") || href.starts_with("https://")) return href;
  if (!href.starts_with("file://")) return std::nullopt;
  std::string path = unescaped(std::string_view(href).substr(7));
  if (path.starts_with("localhost/")) path = path.substr(9);
  return path.starts_with('/') && path.find('\0') == std::string::npos ? std::optional(std::filesystem::path(path).lexically_normal().string()) : std::nullopt;
}

}  // namespace

Result<RasterList> read_stac(std::string_view text, const std::filesystem::path& folder, const std::string& name, const geo::Ellipsoid& world) {
  ListMaker made(name);
  std::size_t number = 0;
  bool has_assets = false;
  const auto take = [&](const Json& item) {
    ++number;
    has_assets = has_assets || member(item, "assets") != nullptr;
    const std::string id = text_of(item, "id");
    const std::string called = id.empty() ? fmt::format("{}: item {}", name, number) : fmt::format("{}: item {}", name, in_quotes(id));
    const Json* asset = asset_of(item);
    if (asset == nullptr) {
      made.leave_out(fmt::format("{} names no raster among its assets.", called));
      return true;
    }
    const std::string href = text_of(*asset, "href");
    std::optional<std::string> path = path_of(href, folder);
    if (!path) {
      made.leave_out(fmt::format("{} names its raster by {}, which is neither a file nor an http: or https: URL.", called, in_quotes(href)));
      return true;
    }
    ListedRaster raster{std::move(*path), ring_of(item, world), Metres(0.0)};
    raster.spacing = spacing_of(item, *asset, raster.ring);
    return made.add(std::move(raster));
  };
  ItemReader reader(take);
  Json::sax_parse(text.begin(), text.end(), &reader);
  if (reader.error) return Error{reader.error->code, fmt::format("{}: {}", name, reader.error->message)};
  const auto unsupported = [&](const std::string& what) { return Error{ErrorCode::unsupported, fmt::format("{}: {}", name, what)}; };
  if (!reader.has_features) {
    const std::string type = text_of(reader.root, "type");
    if (type == "Collection" || type == "Catalog")
      return unsupported(fmt::format("is a STAC {}, which names its items by links; save the items as one file (a collection's /items, or a search's answer)", type));
    if (member(reader.root, "assets") == nullptr) return unsupported("is no STAC item and no collection of items");
    take(reader.root);
  } else if (number > 0 && !has_assets) {
    return unsupported("is no collection of STAC items: none of its features has assets");
  }
  return std::move(made).finish();
}

}  // namespace tellurion::source
