#include "source/proj/crs_axes.h"

#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "source/proj/proj_context.h"

namespace tellurion::source {
namespace {

struct Axis {
  std::string name;
  std::string direction;
  double unit = 0.0;  ///< in metres or radians
};

std::optional<Axis> axis_of(PJ_CONTEXT* context, const PJ* crs, int index) {
  const PjPtr system(proj_crs_get_coordinate_system(context, crs));
  const char *name = nullptr, *direction = nullptr;
  Axis axis;
  if (!system || !proj_cs_get_axis_info(context, system.get(), index, &name, nullptr, &direction, &axis.unit, nullptr, nullptr, nullptr)) return std::nullopt;
  axis.name = name ? name : "";
  axis.direction = direction ? direction : "";
  return axis;
}

}  // namespace

Result<CrsAxes> axes_of(const std::string& crs) {
  ProjContext context;
  PJ_CONTEXT* const ctx = context.get();
  PjPtr whole(proj_create(ctx, crs.c_str()));
  if (!whole || !proj_is_crs(whole.get())) return Error{ErrorCode::invalid_argument, fmt::format("PROJ does not know the CRS \"{}\"", crs)};
  if (proj_get_type(whole.get()) == PJ_TYPE_COMPOUND_CRS) whole.reset(proj_crs_get_sub_crs(ctx, whole.get(), 0));
  if (whole && proj_get_type(whole.get()) == PJ_TYPE_BOUND_CRS) whole.reset(proj_get_source_crs(ctx, whole.get()));
  const PJ_TYPE type = whole ? proj_get_type(whole.get()) : PJ_TYPE_UNKNOWN;
  const bool geographic = type == PJ_TYPE_GEOGRAPHIC_2D_CRS || type == PJ_TYPE_GEOGRAPHIC_3D_CRS;
  if (!geographic && type != PJ_TYPE_PROJECTED_CRS) return Error{ErrorCode::unsupported, fmt::format("the CRS \"{}\" is neither a map projection nor longitude and latitude", crs)};

  // PROJ brings the axes of every CRS, the polar ones' too, into the order of a picture: those that change were the other way round.
  const PjPtr upright(proj_normalize_for_visualization(ctx, whole.get()));
  const std::optional<Axis> first = axis_of(ctx, whole.get(), 0);
  const std::optional<Axis> shown = upright ? axis_of(ctx, upright.get(), 0) : std::nullopt;
  const PjPtr ellipsoid(proj_get_ellipsoid(ctx, whole.get()));
  CrsAxes axes;
  if (!first || !shown || !(first->unit > 0.0) || !ellipsoid || !proj_ellipsoid_get_parameters(ctx, ellipsoid.get(), &axes.radius, nullptr, nullptr, nullptr))
    return Error{ErrorCode::unsupported, fmt::format("the CRS \"{}\" has no axes that can be used", crs)};
  axes.name = proj_get_name(whole.get());
  axes.north_first = first->name != shown->name || first->direction != shown->direction;
  axes.is_geographic = geographic;
  axes.metres_per_unit = geographic ? 1.0 : first->unit;
  return axes;
}

}  // namespace tellurion::source
