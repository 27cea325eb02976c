#include "surface/global_heights.h"

#include <cmath>
#include <random>

#include <doctest/doctest.h>

#include "surface/made_world.h"

using namespace tellurion;
using namespace tellurion::surface;
using namespace tellurion::surface::testing;

namespace {

/// Metres at a place, smooth over the whole body, poles and antimeridian included.
double smooth(const geo::LatLon& place) {
  const glm::dvec3 n = geo::normal_at(place).xyz;
  return 3000.0 * n.x * n.y + 2000.0 * n.z - 1000.0 * n.x * n.z;
}

MadeWorld smooth_world() {
  MadeRaster raster;
  raster.width = 1440, raster.height = 720;
  raster.metres = [](int x, int y) { return static_cast<float>(smooth(at(90.0 - (y + 0.5) / 4.0, -180.0 + (x + 0.5) / 4.0))); };
  return MadeWorld({layer_of(raster, 1)});
}

}  // namespace

TEST_CASE("GlobalHeights: the whole body's heights, as near as its grid can have them") {
  MadeWorld world = smooth_world();
  const GlobalHeights global = GlobalHeights::make(*world.model).value();
  CHECK(global.spacing() == doctest::Approx(6378137.0 * kPi / 2.0 / 128.0));
  // The second derivative of `smooth` is at most 4 * 3000 m per radian^2 on either axis; cells, of the grid and of the quarter degrees that
  // it is made of, are at most 0.0175 radians: f'' h^2 / 8 of both axes and both grids, and what averaging levels takes.
  const double tolerance = 4 * 12000.0 * 0.0175 * 0.0175 / 8.0 + 0.5;
  const auto seed = fresh_seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 2000; ++i) {
    const geo::LatLon place{Radians(std::asin(unit(random))), Radians(kPi * unit(random))};
    if (std::abs(place.latitude.value) < to_radians(Degrees(89.0)).value) CHECK(std::abs(global.at(place) - smooth(place)) < tolerance);
  }
  // The raster's outermost rows, half a degree high where they are averaged, are continued to the poles: the slope, at most 3,200 m a radian,
  // over half of that.
  for (const double pole : {-90.0, 90.0}) CHECK(std::abs(global.at(at(pole, 12.0)) - smooth(at(pole, 12.0))) < 3200.0 * 0.25 * kPi / 180.0);
}

TEST_CASE("GlobalHeights: no step where two faces meet") {
  MadeWorld world = smooth_world();
  const GlobalHeights global = GlobalHeights::make(*world.model).value();
  for (double latitude = -89.0; latitude < 89.5; latitude += 0.37) {
    for (const double seam : {-135.0, -45.0, 45.0, 135.0, 180.0}) {
      CHECK(std::abs(global.at(at(latitude, seam - 1e-9)) - global.at(at(latitude, seam + 1e-9))) < 1e-3);
    }
  }
}

TEST_CASE("an elevation model that reads nothing knows what others have read, and says so where they have not") {
  MadeWorld world = smooth_world();
  ElevationModel idle = ElevationModel::open(world.description, world.blocks).value();
  idle.read_nothing();
  source::Awaited awaited;
  const auto nothing = idle.height_at(at(47.0, 8.0), Lookup::bilinear);
  REQUIRE(nothing.has_value());
  CHECK(idle.take_pending(awaited));
  CHECK(awaited.empty());
  CHECK(world.blocks.bytes() == 0);

  const double truth = world.model->height_at(at(47.0, 8.0), Lookup::bilinear)->metres;
  CHECK(idle.height_at(at(47.0, 8.0), Lookup::bilinear)->metres == truth);
  CHECK_FALSE(idle.take_pending(awaited));
  (void)idle.height_at(at(-47.0, -120.0), Lookup::bilinear);  // another block
  CHECK(idle.take_pending(awaited));
}
