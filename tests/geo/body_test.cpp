#include "geo/body.h"

#include <doctest/doctest.h>
#include <proj.h>

#include <string>

using namespace tellurion;
using namespace tellurion::geo;

TEST_CASE("bodies: have the radii of PROJ's catalogue of the IAU report of 2015") {
  PJ_CONTEXT* const context = proj_context_create();
  int found = 0;
  for (const Body& body : bodies()) {
    if (body.name == "Earth") continue;  // WGS 84, not the IAU's
    CAPTURE(std::string(body.name));
    const bool sphere = body.ellipsoid.a() == body.ellipsoid.b();
    const std::string name = std::string(body.name) + " (2015)" + (sphere ? " - Sphere" : "");
    const PJ_TYPE type = PJ_TYPE_ELLIPSOID;
    PJ_OBJ_LIST* const list = proj_create_from_name(context, "IAU_2015", name.c_str(), &type, 1, 0, 10, nullptr);
    PJ* const ellipsoid = list != nullptr ? proj_list_get(context, list, 0) : nullptr;
    proj_list_destroy(list);
    REQUIRE(ellipsoid != nullptr);
    double a = 0.0, b = 0.0;
    REQUIRE(proj_ellipsoid_get_parameters(context, ellipsoid, &a, &b, nullptr, nullptr));
    CHECK(body.ellipsoid.a() == doctest::Approx(a).epsilon(1e-12));
    CHECK(body.ellipsoid.b() == doctest::Approx(b).epsilon(1e-12));
    proj_destroy(ellipsoid);
    ++found;
  }
  CHECK(found == static_cast<int>(bodies().size()) - 1);
  proj_context_destroy(context);
}

TEST_CASE("find_body: takes any case of letters, and only whole names") {
  CHECK(find_body("earth")->ellipsoid == kWgs84);
  CHECK(find_body("MARS")->ellipsoid == kMars);
  CHECK(find_body("Moon")->name == "Moon");
  CHECK_FALSE(find_body(""));
  CHECK_FALSE(find_body("Mar"));
  CHECK_FALSE(find_body("Earth "));
}
