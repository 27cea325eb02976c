#include "source/proj/vertical_datum.h"

#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "base/number.h"
#include "source/proj/proj_context.h"
#include "source/proj/projection.h"

namespace tellurion::source {
namespace {

struct ListDelete {
  void operator()(PJ_OBJ_LIST* list) const { proj_list_destroy(list); }
};
struct FactoryDelete {
  void operator()(PJ_OPERATION_FACTORY_CONTEXT* factory) const { proj_operation_factory_context_destroy(factory); }
};

constexpr double kSameBody = 0.05;  ///< a sphere whose radius differs by more is none of the body's

/// How far along its normal the ellipsoid's surface is from a sphere round the centre.
double height_of_sphere(const geo::Ellipsoid& world, double radius, const geo::LatLon& place) {
  const geo::Vector<geo::Ecef> normal = geo::normal_at(place);
  const glm::dvec3 point = geo::surface_point(world, normal).xyz;
  const double along = glm::dot(point, normal.xyz);
  const double aside = glm::dot(point, point) - along * along;
  return std::sqrt(radius * radius - aside) - along;
}

std::string code_of(const std::string& definition) {
  struct Alias {
    const char* name;
    const char* code;
  };
  for (const Alias& alias : {Alias{"egm84", "EPSG:5798"}, Alias{"egm96", "EPSG:5773"}, Alias{"egm2008", "EPSG:3855"}, Alias{"navd88", "EPSG:5703"}}) {
    if (definition == alias.name) return alias.code;
  }
  return definition;
}

/// Names of the grids that ways from `crs` to `target` would need and that are not installed.
std::string missing_grids(PJ_CONTEXT* context, const PJ* crs, const PJ* target) {
  const std::unique_ptr<PJ_OPERATION_FACTORY_CONTEXT, FactoryDelete> factory(proj_create_operation_factory_context(context, nullptr));
  proj_operation_factory_context_set_grid_availability_use(context, factory.get(), PROJ_GRID_AVAILABILITY_IGNORED);
  const std::unique_ptr<PJ_OBJ_LIST, ListDelete> ways(proj_create_operations(context, crs, target, factory.get()));
  std::string names;
  for (int i = 0; ways && i < proj_list_get_count(ways.get()); ++i) {
    const PjPtr way(proj_list_get(context, ways.get(), i));
    for (int grid = 0; way && grid < proj_coordoperation_get_grid_used_count(context, way.get()); ++grid) {
      const char* name = nullptr;
      int available = 0;
      proj_coordoperation_get_grid_used(context, way.get(), grid, &name, nullptr, nullptr, nullptr, nullptr, nullptr, &available);
      if (available || name == nullptr || names.find(name) != std::string::npos) continue;
      names += (names.empty() ? "" : ", ") + std::string(name);
    }
  }
  return names;
}

/// Metres up of one unit of the vertical CRS: negative where it counts depths.
double slope_of(PJ_CONTEXT* context, const PJ* vertical) {
  const PjPtr axes(proj_crs_get_coordinate_system(context, vertical));
  const char* direction = nullptr;
  double unit = 1.0;
  if (!axes || !proj_cs_get_axis_info(context, axes.get(), 0, nullptr, nullptr, &direction, &unit, nullptr, nullptr, nullptr)) return 1.0;
  return std::string(direction) == "down" ? -unit : unit;
}

}  // namespace

struct VerticalDatum::State {
  ProjContext context;
  PjPtr operation;  ///< (longitude, latitude, height) in degrees and the datum's unit -> the same above the ellipsoid; not of spheres
  std::optional<double> sphere;  ///< radius
  geo::Ellipsoid world;
  std::string name;
  double slope = 1.0;
  std::vector<std::array<double, 3>> room;
};

VerticalDatum::VerticalDatum(std::unique_ptr<State> state) : state_(std::move(state)) {}
VerticalDatum::VerticalDatum(VerticalDatum&&) noexcept = default;
VerticalDatum& VerticalDatum::operator=(VerticalDatum&&) noexcept = default;
VerticalDatum::~VerticalDatum() = default;

std::string sphere_datum(Metres radius) { return fmt::format("{} {}", kSphereDatum, radius.value); }

Result<VerticalDatum> VerticalDatum::create(const std::string& definition, const geo::Ellipsoid& world) {
  auto state = std::make_unique<State>();
  if (const std::string begin = fmt::format("{} ", kSphereDatum); definition.starts_with(begin)) {
    state->sphere = parse_number(std::string_view(definition).substr(begin.size()));
    if (!state->sphere || !(std::abs(*state->sphere / world.a() - 1.0) < kSameBody)) {
      return Error{ErrorCode::invalid_argument, fmt::format("\"{}\" is no sphere of this body, whose radius is {:.0f} m: say \"sphere {:.0f}\", or \"sphere\" for that of the "
                                                            "raster's own coordinate system", definition, world.a(), world.a())};
    }
    state->name = definition;
    state->world = world;
    return VerticalDatum(std::move(state));
  }
  if (!is_earth(world)) {
    return Error{ErrorCode::invalid_argument, fmt::format("vertical = \"{}\" is a datum of the Earth; here \"ellipsoid\", \"sphere\" and \"sphere RADIUS\" can be", definition)};
  }
  PJ_CONTEXT* const ctx = state->context.get();
  PjPtr vertical(proj_create(ctx, code_of(definition).c_str()));
  if (vertical && proj_get_type(vertical.get()) == PJ_TYPE_COMPOUND_CRS) vertical.reset(proj_crs_get_sub_crs(ctx, vertical.get(), 1));
  if (!vertical || proj_get_type(vertical.get()) != PJ_TYPE_VERTICAL_CRS) {
    return Error{ErrorCode::invalid_argument,
                 fmt::format("\"{}\" is no vertical datum that PROJ knows; say \"ellipsoid\", \"egm96\" or a code like \"EPSG:5773\"", definition)};
  }
  state->name = proj_get_name(vertical.get());
  state->slope = slope_of(ctx, vertical.get());
  const PjPtr horizontal(proj_create(ctx, "EPSG:4326"));
  const PjPtr target(proj_create(ctx, "EPSG:4979"));
  const std::string text = fmt::format("COMPOUNDCRS[\"heights\",{},{}]", proj_as_wkt(ctx, horizontal.get(), PJ_WKT2_2019, nullptr),
                                       proj_as_wkt(ctx, vertical.get(), PJ_WKT2_2019, nullptr));
  const PjPtr compound(proj_create(ctx, text.c_str()));
  constexpr std::array<const char*, 2> kNoGuess{"ALLOW_BALLPARK=NO", nullptr};  // which would pass heights through unchanged
  const PjPtr found(compound ? proj_create_crs_to_crs_from_pj(ctx, compound.get(), target.get(), nullptr, kNoGuess.data()) : nullptr);
  if (found) state->operation.reset(proj_normalize_for_visualization(ctx, found.get()));
  const std::string missing = state->operation || !compound ? std::string() : missing_grids(ctx, compound.get(), target.get());
  if (!state->operation) {
    return Error{ErrorCode::unsupported,
                 missing.empty() ? fmt::format("PROJ knows no way from the vertical datum \"{}\" to the ellipsoid", state->name)
                                 : fmt::format("the vertical datum \"{}\" needs a grid that PROJ does not have here ({}): install it, "
                                               "or say vertical = \"ellipsoid\" to take the heights as they are", state->name, missing)};
  }
  return VerticalDatum(std::move(state));
}

const std::string& VerticalDatum::name() const { return state_->name; }
double VerticalDatum::slope() const { return state_->slope; }

void VerticalDatum::undulations(std::span<const geo::LatLon> places, std::span<double> metres) {
  assert(places.size() == metres.size());
  if (state_->sphere) {
    for (std::size_t i = 0; i < places.size(); ++i) metres[i] = height_of_sphere(state_->world, *state_->sphere, places[i]);
    return;
  }
  constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;
  std::vector<std::array<double, 3>>& c = state_->room;
  c.clear();
  for (const geo::LatLon& place : places) c.push_back({place.longitude.value * kDegreesPerRadian, place.latitude.value * kDegreesPerRadian, 0.0});
  if (c.empty()) return;
  constexpr std::size_t kStride = sizeof(c[0]);
  proj_trans_generic(state_->operation.get(), PJ_FWD, &c[0][0], kStride, c.size(), &c[0][1], kStride, c.size(), &c[0][2], kStride, c.size(),
                     nullptr, 0, 0);
  for (std::size_t i = 0; i < metres.size(); ++i) {
    metres[i] = std::isfinite(c[i][2]) && std::isfinite(c[i][0]) ? c[i][2] : std::numeric_limits<double>::quiet_NaN();
  }
}

}  // namespace tellurion::source
