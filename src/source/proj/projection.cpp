#include "source/proj/projection.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "source/proj/proj_context.h"

namespace tellurion::source {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180.0;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Bodies whose equatorial radii differ by more are different bodies.
constexpr double kRadiusTolerance = 0.01;

/// Geotransforms are written with few digits: so far beyond a pole is the pole (11 m on Earth).
constexpr double kRoundingDegrees = 1e-4;

enum class Method { geographic, web_mercator, proj };

bool same_radius(double a, double b) { return std::abs(a - b) <= kRadiusTolerance * b; }

std::string body_of(double radius) {
  struct Body {
    const char* name;
    double radius;
  };
  for (const Body& body : {Body{"Earth", geo::kWgs84.a()}, Body{"the Moon", geo::kMoon.a()}, Body{"Mars", geo::kMars.a()}}) {
    if (same_radius(radius, body.radius)) return fmt::format("{} (radius {:.0f} m)", body.name, radius);
  }
  return fmt::format("a body of radius {:.0f} m", radius);
}

/// The CRS without a vertical part and without the shift to WGS 84 that a bound CRS carries.
PjPtr horizontal_part(PJ_CONTEXT* context, const PJ* crs) {
  if (proj_get_type(crs) == PJ_TYPE_COMPOUND_CRS) return PjPtr(proj_crs_get_sub_crs(context, crs, 0));
  return PjPtr(proj_clone(context, crs));
}

/// Whether coordinates are degrees east and north of Greenwich or of the body's own zero meridian.
bool counts_degrees_east(PJ_CONTEXT* context, const PJ* crs) {
  const PJ_TYPE type = proj_get_type(crs);
  if (type != PJ_TYPE_GEOGRAPHIC_2D_CRS && type != PJ_TYPE_GEOGRAPHIC_3D_CRS) return false;
  double meridian = 0.0;
  const PjPtr prime(proj_get_prime_meridian(context, crs));
  if (prime) proj_prime_meridian_get_parameters(context, prime.get(), &meridian, nullptr, nullptr);
  if (meridian != 0.0) return false;
  const PjPtr axes(proj_crs_get_coordinate_system(context, crs));
  for (int i = 0; i < 2; ++i) {
    const char* direction = nullptr;
    double unit = 0.0;
    if (!axes || !proj_cs_get_axis_info(context, axes.get(), i, nullptr, nullptr, &direction, &unit, nullptr, nullptr, nullptr)) {
      return false;
    }
    const std::string to(direction);
    if ((to != "east" && to != "north") || std::abs(unit - kDegree) > 1e-15) return false;
  }
  return true;
}

bool is_equivalent(PJ_CONTEXT* context, const PJ* crs, const char* code) {
  const PjPtr other(proj_create(context, code));
  return other && proj_is_equivalent_to_with_ctx(context, crs, other.get(), PJ_COMP_EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS);
}

/// Degrees east and north on `e`. As WKT: then PROJ takes it for the same body as the raster's CRS, which comes as WKT too.
std::string geographic_wkt(const geo::Ellipsoid& e) {
  const double inverse_flattening = e.a() == e.b() ? 0.0 : e.a() / (e.a() - e.b());
  return fmt::format(
      "GEOGCRS[\"places\",DATUM[\"body\",ELLIPSOID[\"body\",{},{},LENGTHUNIT[\"metre\",1]]],"
      "PRIMEM[\"zero\",0,ANGLEUNIT[\"degree\",0.0174532925199433]],CS[ellipsoidal,2],"
      "AXIS[\"longitude\",east,ORDER[1],ANGLEUNIT[\"degree\",0.0174532925199433]],"
      "AXIS[\"latitude\",north,ORDER[2],ANGLEUNIT[\"degree\",0.0174532925199433]]]",
      e.a(), inverse_flattening);
}

std::string vertical_part(PJ_CONTEXT* context, const PJ* crs) {
  if (proj_get_type(crs) == PJ_TYPE_GEOGRAPHIC_3D_CRS) return "ellipsoid";
  if (proj_get_type(crs) != PJ_TYPE_COMPOUND_CRS) return {};
  const PjPtr vertical(proj_crs_get_sub_crs(context, crs, 1));
  return vertical ? proj_get_name(vertical.get()) : std::string();
}

}  // namespace

bool is_earth(const geo::Ellipsoid& world) { return same_radius(world.a(), geo::kWgs84.a()); }

struct Projection::State {
  ProjContext context;
  PjPtr operation;  ///< from degrees (longitude, latitude) to coordinates; only with Method::proj
  Method method = Method::proj;
  CrsFacts facts;
  bool north_first = false;  ///< `operation` gives the latitude before the longitude
  double latitude_factor = 1.0;  ///< tan(latitude in the world) / tan(latitude in the CRS)
  std::optional<double> period;

  Result<void> open(const std::string& crs_text, const geo::Ellipsoid& world, glm::dvec2 centre);
  Result<void> read_ellipsoid(const PJ* crs, const geo::Ellipsoid& world);
  Result<void> make_operation(const PJ* crs, bool on_earth, glm::dvec2 centre);
  bool puts_north_first(const PJ* crs);
  void find_period();
};

Result<void> Projection::State::open(const std::string& crs_text, const geo::Ellipsoid& world, glm::dvec2 centre) {
  PJ_CONTEXT* const ctx = context.get();
  const PjPtr whole(proj_create(ctx, crs_text.c_str()));
  if (!whole || !proj_is_crs(whole.get())) {
    return {ErrorCode::invalid_argument, fmt::format("PROJ does not know the CRS \"{}\"", crs_text)};
  }
  const PjPtr crs = horizontal_part(ctx, whole.get());
  if (!crs) return {ErrorCode::internal, "PROJ gives no horizontal part of the CRS"};
  facts.name = proj_get_name(whole.get());
  facts.vertical = vertical_part(ctx, whole.get());
  if (Result<void> read = read_ellipsoid(crs.get(), world); !read) return read;

  const bool on_earth = is_earth(world);
  if (!on_earth) {
    const auto squeeze = [](const geo::Ellipsoid& e) { return (e.b() / e.a()) * (e.b() / e.a()); };
    latitude_factor = squeeze(facts.ellipsoid) / squeeze(world);
  }
  if (counts_degrees_east(ctx, crs.get()) && (!on_earth || is_equivalent(ctx, crs.get(), "EPSG:4326") ||
                                             is_equivalent(ctx, crs.get(), "EPSG:4979"))) {
    method = Method::geographic;
    period = 360.0;
    return {};
  }
  if (on_earth && is_equivalent(ctx, crs.get(), "EPSG:3857")) {
    method = Method::web_mercator;
    period = 2.0 * kPi * geo::kWgs84.a();
    return {};
  }
  if (Result<void> made = make_operation(crs.get(), on_earth, centre); !made) return made;
  find_period();
  return {};
}

Result<void> Projection::State::read_ellipsoid(const PJ* crs, const geo::Ellipsoid& world) {
  PJ_CONTEXT* const ctx = context.get();
  const PjPtr ellipsoid(proj_get_ellipsoid(ctx, crs));
  double a = 0.0;
  double b = 0.0;
  if (!ellipsoid || !proj_ellipsoid_get_parameters(ctx, ellipsoid.get(), &a, &b, nullptr, nullptr) || !(a > 0.0)) {
    return {ErrorCode::unsupported, fmt::format("its CRS \"{}\" lies on no ellipsoid", facts.name)};
  }
  facts.ellipsoid = geo::Ellipsoid{Metres(a), Metres(b)};
  if (!same_radius(a, world.a())) {
    return {ErrorCode::invalid_argument, fmt::format("its CRS \"{}\" is of {}, the world is {}; name the right planet in the world file, or say which CRS is right: crs = \"...\"", facts.name, body_of(a), body_of(world.a()))};
  }
  return {};
}

Result<void> Projection::State::make_operation(const PJ* crs, bool on_earth, glm::dvec2 centre) {
  PJ_CONTEXT* const ctx = context.get();
  const PjPtr places(proj_create(ctx, on_earth ? "EPSG:4326" : geographic_wkt(facts.ellipsoid).c_str()));
  const PjPtr found(places ? proj_create_crs_to_crs_from_pj(ctx, places.get(), crs, nullptr, nullptr) : nullptr);
  operation.reset(found ? proj_normalize_for_visualization(ctx, found.get()) : nullptr);
  if (!operation) {
    return {ErrorCode::unsupported, fmt::format("PROJ finds no way from its CRS \"{}\" to latitude and longitude: {}", facts.name,
                                                context.last_message())};
  }
  north_first = puts_north_first(crs);
  if (north_first) std::swap(centre.x, centre.y);
  proj_trans(operation.get(), PJ_INV, proj_coord(centre.x, centre.y, 0.0, HUGE_VAL));
  if (PjPtr best{proj_trans_get_last_used_operation(operation.get())}) operation = std::move(best);
  return {};
}

/// PROJ brings latitude and longitude into the order of a picture, but not where longitudes count to the west or latitudes are
/// planetocentric ones of an ellipsoid.
bool Projection::State::puts_north_first(const PJ* crs) {
  if (proj_get_type(crs) == PJ_TYPE_PROJECTED_CRS) return false;
  const PJ_COORD here = proj_trans(operation.get(), PJ_FWD, proj_coord(10.0, 20.0, 0.0, HUGE_VAL));
  const PJ_COORD north = proj_trans(operation.get(), PJ_FWD, proj_coord(10.0, 21.0, 0.0, HUGE_VAL));
  return std::abs(north.xy.x - here.xy.x) > std::abs(north.xy.y - here.xy.y);
}

/// Cylindrical: x is linear in longitude and does not know the latitude, y the other way round.
void Projection::State::find_period() {
  const auto project = [&](double lon, double lat) {
    const PJ_COORD c = proj_trans(operation.get(), PJ_FWD, proj_coord(lon, lat, 0.0, HUGE_VAL));
    return north_first ? glm::dvec2(c.xy.y, c.xy.x) : glm::dvec2(c.xy.x, c.xy.y);
  };
  // Three places within the half circle round the projection's own meridian, wherever that is.
  for (const double lon : {0.0, 90.0}) {
    const glm::dvec2 origin = project(lon, 5.0);
    const glm::dvec2 east = project(lon + 7.0, 5.0);
    const glm::dvec2 far_east = project(lon + 21.0, 5.0);
    const glm::dvec2 north = project(lon + 7.0, 40.0);
    const double step = (east.x - origin.x) / 7.0;
    const double tolerance = std::abs(step) * 1e-9;
    if (std::abs(step) > 0.0 && std::abs(far_east.x - origin.x - 21.0 * step) < tolerance && std::abs(north.x - east.x) < tolerance &&
        std::abs(far_east.y - origin.y) < tolerance) {
      period = 360.0 * std::abs(step);
      return;
    }
  }
}

Projection::Projection(std::unique_ptr<State> state) : state_(std::move(state)) {}
Projection::Projection(Projection&&) noexcept = default;
Projection& Projection::operator=(Projection&&) noexcept = default;
Projection::~Projection() = default;

std::string geographic_crs(const geo::Ellipsoid& world) {
  const bool on_earth = std::abs(world.a() / geo::kWgs84.a() - 1.0) <= 0.01;
  return on_earth ? "OGC:CRS84" : fmt::format("+proj=longlat +a={:.3f} +b={:.3f} +no_defs +type=crs", world.a(), world.b());
}

Result<Projection> Projection::create(const std::string& crs, const geo::Ellipsoid& world, glm::dvec2 centre) {
  auto state = std::make_unique<State>();
  if (Result<void> opened = state->open(crs, world, centre); !opened) return opened.error();
  return Projection(std::move(state));
}

const CrsFacts& Projection::facts() const { return state_->facts; }
std::optional<double> Projection::period() const { return state_->period; }

void Projection::to_places(std::span<const glm::dvec2> coordinates, std::span<geo::LatLon> places) {
  assert(coordinates.size() == places.size());
  const double k = state_->latitude_factor;
  const auto place = [k](double north, double east) {
    if (!(std::abs(north) <= 90.0 + kRoundingDegrees) || !std::isfinite(east)) return geo::LatLon{Radians(kNaN), Radians(kNaN)};
    const double latitude = std::clamp(north, -90.0, 90.0) * kDegree;
    const double turned = east - 360.0 * std::round(east / 360.0);
    return geo::LatLon{Radians(k == 1.0 ? latitude : std::atan2(k * std::sin(latitude), std::cos(latitude))), Radians(turned * kDegree)};
  };

  if (state_->method == Method::geographic) {
    for (std::size_t i = 0; i < places.size(); ++i) places[i] = place(coordinates[i].y, coordinates[i].x);
    return;
  }
  if (state_->method == Method::web_mercator) {
    const double radius = geo::kWgs84.a();
    for (std::size_t i = 0; i < places.size(); ++i) {
      places[i] = place(std::atan(std::sinh(coordinates[i].y / radius)) / kDegree, coordinates[i].x / radius / kDegree);
    }
    return;
  }
  std::vector<glm::dvec2> degrees(coordinates.begin(), coordinates.end());
  if (state_->north_first) {
    for (glm::dvec2& c : degrees) std::swap(c.x, c.y);
  }
  if (!degrees.empty()) {
    proj_trans_generic(state_->operation.get(), PJ_INV, &degrees[0].x, sizeof(glm::dvec2), degrees.size(), &degrees[0].y,
                       sizeof(glm::dvec2), degrees.size(), nullptr, 0, 0, nullptr, 0, 0);
  }
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = place(degrees[i].y, degrees[i].x);
}

void Projection::to_coordinates(std::span<const geo::LatLon> places, std::span<glm::dvec2> coordinates) {
  assert(coordinates.size() == places.size());
  const double k = state_->latitude_factor;
  const auto latitude_of = [k](const geo::LatLon& place) {
    const double latitude = place.latitude.value;
    return k == 1.0 ? latitude : std::atan2(std::sin(latitude), k * std::cos(latitude));
  };

  if (state_->method == Method::web_mercator) {
    const double radius = geo::kWgs84.a();
    for (std::size_t i = 0; i < places.size(); ++i) {
      coordinates[i] = {radius * places[i].longitude.value, radius * std::asinh(std::tan(places[i].latitude.value))};
    }
    return;
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    coordinates[i] = {places[i].longitude.value / kDegree, latitude_of(places[i]) / kDegree};
  }
  if (state_->method == Method::geographic || coordinates.empty()) return;
  proj_trans_generic(state_->operation.get(), PJ_FWD, &coordinates[0].x, sizeof(glm::dvec2), coordinates.size(), &coordinates[0].y,
                     sizeof(glm::dvec2), coordinates.size(), nullptr, 0, 0, nullptr, 0, 0);
  for (glm::dvec2& c : coordinates) {
    if (!std::isfinite(c.x) || !std::isfinite(c.y)) c = {kNaN, kNaN};
    if (state_->north_first) std::swap(c.x, c.y);
  }
}

}  // namespace tellurion::source
