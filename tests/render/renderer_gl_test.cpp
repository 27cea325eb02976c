#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include "render/renderer.h"
#include "render/test_planet.h"
#include "render/test_stage.h"

using namespace tellurion;
using namespace tellurion::render;
using namespace tellurion::render::test;
using surface::DrawTile;

namespace {

struct Difference {
  int largest = 0;
  double share_beyond_5 = 0;  // of the pixels
};

Difference compare(const raster::Image& a, const raster::Image& b) {
  REQUIRE(a.rgba.size() == b.rgba.size());
  Difference d;
  for (std::size_t pixel = 0; pixel < a.rgba.size(); pixel += 4) {
    int worst = 0;
    for (std::size_t i = pixel; i < pixel + 3; ++i) worst = std::max(worst, std::abs(int(a.rgba[i]) - int(b.rgba[i])));
    d.largest = std::max(d.largest, worst);
    d.share_beyond_5 += worst > 5 ? 1.0 : 0.0;
  }
  d.share_beyond_5 /= static_cast<double>(a.rgba.size() / 4);
  return d;
}

/// Distance along a unit ray to the ellipsoid, by the quadratic of the ray in the space where it is a sphere; NaN: missed.
double ray_to_ellipsoid(const geo::Ellipsoid& e, const glm::dvec3& eye, const glm::dvec3& ray) {
  const glm::dvec3 scale = 1.0 / glm::dvec3(e.a(), e.a(), e.b());
  const glm::dvec3 p = eye * scale;
  const glm::dvec3 d = ray * scale;
  const double a = glm::dot(d, d);
  const double half_b = glm::dot(p, d);
  const double c = glm::dot(p, p) - 1.0;
  return c / (-half_b + std::sqrt(half_b * half_b - a * c));  // the nearer root, without cancellation
}

/// The tiles of `level` within `reach` tiles of the one under `place`.
std::vector<geo::TileKey> tiles_round(const geo::LatLon& place, int level, int reach) {
  const geo::TileKey middle = geo::tile_at(geo::normal_at(place), level);
  std::vector<geo::TileKey> keys;
  for (int y = -reach; y <= reach; ++y)
    for (int x = -reach; x <= reach; ++x)
      keys.push_back({middle.face, middle.level, middle.x + static_cast<std::uint32_t>(x), middle.y + static_cast<std::uint32_t>(y)});
  return keys;
}

std::array<int, 3> pixel(const raster::Image& image, int x, int y) {
  const auto c = image.at(x, y);
  return {c[0], c[1], c[2]};
}

}  // namespace

TEST_CASE("picture: OpenGL, OpenGL ES and a context without clip control agree") {
  const view::Camera cameras[] = {camera_at("30,20,9000000"), camera_at("-40,110,400000,70,-25")};
  FrameLook look;
  look.to_sun = {glm::normalize(glm::dvec3(0.7, 0.5, 0.2))};
  std::vector<raster::Image> pictures[2];
  for (const auto& [api, without] : {std::pair(gpu::Api::core, ""), {gpu::Api::es, ""}, {gpu::Api::core, "clip_control"},
                                     {gpu::Api::es, "clip_control"}}) {
    Stage stage(api, without);
    const auto tiles = upload_level(*stage.thread, *stage.renderer, geo::kWgs84, 1, flat, checker, 64);
    for (std::size_t i = 0; i < 2; ++i) pictures[i].push_back(stage.picture(cameras[i], look, tiles));
  }
  for (const auto& same : pictures) {
    CHECK(pixel(same[0], kWidth / 2, kHeight * 3 / 4) != pixel(same[0], 0, 0));
    for (std::size_t i = 1; i < same.size(); ++i) {
      const Difference d = compare(same[0], same[i]);
      INFO("variant ", i, ": largest difference ", d.largest);
      CHECK(d.share_beyond_5 <= 0.001);
    }
  }
}

TEST_CASE("picture: without light and air the ground has its image's colours where they belong") {
  Stage stage(gpu::Api::core);
  const auto tiles = upload_level(*stage.thread, *stage.renderer, geo::kWgs84, 2, flat, checker);
  for (const char* pose : {"5,5,3000000", "55,-95,2000000", "-65,175,2500000", "89,0,3000000", "-89,0,3000000"}) {
    const view::Camera camera = camera_at(pose);
    const raster::Image image = stage.picture(camera, bare_look(), tiles);
    int near_edges = 0;
    for (int y = 0; y < kHeight; y += 3) {
      for (int x = 0; x < kWidth; x += 3) {
        const geo::Vector<geo::Ecef> ray = camera.ray({x + 0.5, y + 0.5});
        const double distance = ray_to_ellipsoid(geo::kWgs84, camera.eye.xyz, ray.xyz);
        if (!(distance > 0)) continue;
        const auto place = geo::to_geodetic(geo::kWgs84, camera.eye + ray * distance);
        const glm::dvec3 wanted = 255.0 * checker(geo::normal_at(geo::place_of(place)));
        const auto c = pixel(image, x, y);
        const double error = glm::length(wanted - glm::dvec3(c[0], c[1], c[2]));
        near_edges += error > 8.0 ? 1 : 0;
      }
    }
    INFO(pose);
    CHECK(near_edges < kWidth * kHeight / 9 * 0.2);  // pixels that touch the squares' edges
  }
}

TEST_CASE("picture: nothing resident shows the clear colour") {
  Stage stage(gpu::Api::core);
  FrameLook look = bare_look();
  look.clear = {1.0f, 0.0f, 1.0f};
  const DrawTile missing = draw_alone({});
  const auto image = stage.picture(camera_at("0,0,1000000"), look, {&missing, 1});
  CHECK(pixel(image, kWidth / 2, kHeight / 2) == std::array<int, 3>{255, 0, 255});
}

TEST_CASE("picture: ground without any image is a light grey") {
  Stage stage(gpu::Api::core);
  REQUIRE(stage.renderer->upload_geometry(*stage.thread, {}, exact_geometry(geo::kWgs84, {}, flat)).has_value());
  const DrawTile tile = draw_alone({});
  const auto c = pixel(stage.picture(camera_at("0,0,1000000"), bare_look(), {&tile, 1}), kWidth / 2, kHeight / 2);
  CHECK(*std::min_element(c.begin(), c.end()) > 130);
  CHECK(*std::max_element(c.begin(), c.end()) < 190);
}

TEST_CASE("picture: a tile shows its part of an ancestor's slot") {
  Stage stage(gpu::Api::core);
  const geo::TileKey root{};
  const geo::TileKey grandchild{0, 2, 2, 1};
  REQUIRE(stage.renderer->upload_colour(*stage.thread, root, exact_imagery(root, checker)).has_value());
  REQUIRE(stage.renderer->upload_colour(*stage.thread, grandchild, exact_imagery(grandchild, checker)).has_value());
  REQUIRE(stage.renderer->upload_geometry(*stage.thread, grandchild, exact_geometry(geo::kWgs84, grandchild, flat)).has_value());
  DrawTile own = draw_alone(grandchild);
  DrawTile inherited = own;
  inherited.colour_owner = inherited.colour_before = root;
  const view::Camera camera = camera_at("12,12,4500000");
  const auto sharp = stage.picture(camera, bare_look(), {&own, 1});
  const auto soft = stage.picture(camera, bare_look(), {&inherited, 1});
  const Difference d = compare(sharp, soft);
  CHECK(d.largest > 5);  // it is coarser
  CHECK(d.share_beyond_5 < 0.1);

  SUBCASE("and fades from one to the other in proportion") {
    DrawTile fading = own;
    fading.colour_before = root;
    fading.fade = 0.25f;
    const auto mixed = stage.picture(camera, bare_look(), {&fading, 1});
    int worst = 0;
    for (std::size_t i = 0; i < mixed.rgba.size(); ++i)
      worst = std::max(worst, static_cast<int>(std::lround(std::abs(0.25 * sharp.rgba[i] + 0.75 * soft.rgba[i] - mixed.rgba[i]))));
    CHECK(worst <= 2);
  }
}

TEST_CASE("picture: slopes that face the sun are lighter, and the night is dim but not black") {
  Stage stage(gpu::Api::core, "", {.ellipsoid = geo::kWgs84, .air = std::nullopt});
  const geo::TileKey key{0, 6, 32, 32};  // its corner is lat 0, lon 0; s to the east, t to the south
  const auto tilted = [&](glm::vec2 slope) {
    auto geometry = exact_geometry(geo::kWgs84, key, flat);
    geometry.slopes.slopes.assign(surface::kSlopeSlotSide * surface::kSlopeSlotSide, slope);
    REQUIRE(stage.renderer->upload_geometry(*stage.thread, key, geometry).has_value());
    const DrawTile tile = draw_alone(key);
    FrameLook look;
    look.to_sun = geo::enu_at(geo::kWgs84, {})(geo::Vector<geo::Enu>{glm::normalize(glm::dvec3(1.0, 0.0, 1.0))});
    const auto day = pixel(stage.picture(camera_at("-0.5,0.5,50000"), look, {&tile, 1}), kWidth / 2, kHeight / 2)[0];
    look.to_sun = -look.to_sun;
    const auto night = pixel(stage.picture(camera_at("-0.5,0.5,50000"), look, {&tile, 1}), kWidth / 2, kHeight / 2)[0];
    CHECK(night > 5);
    CHECK(night < 50);
    return day;
  };
  const int level = tilted({0.0f, 0.0f});
  CHECK(tilted({-0.5f, 0.0f}) > level + 10);  // falls to the east, where the sun is
  CHECK(tilted({0.5f, 0.0f}) < level - 10);
  CHECK(std::abs(tilted({0.0f, 0.3f}) - tilted({0.0f, -0.3f})) <= 3);
}

TEST_CASE("picture: lights of the night show in the dark only, water mirrors the sun and nothing else") {
  const geo::TileKey key{0, 6, 32, 32};
  const auto shown = [&](std::array<std::uint8_t, 4> night, std::array<std::uint8_t, 4> water, double sun_from_zenith, bool lighting = true) {
    Stage stage(gpu::Api::core, "", {.ellipsoid = geo::kWgs84, .air = std::nullopt});
    REQUIRE(stage.renderer->upload_geometry(*stage.thread, key, exact_geometry(geo::kWgs84, key, flat)).has_value());
    auto imagery = exact_imagery(key, [](const auto&) { return glm::dvec3(0.2); });
    for (const auto& [use, texel] : {std::pair(surface::ImageUse::night, night), std::pair(surface::ImageUse::water, water)}) {
      auto& patch = imagery.effects.emplace_back(imagery.patches.front());
      patch.image = {1, 1, {texel.begin(), texel.end()}};
      patch.use = use;
    }
    REQUIRE(stage.renderer->upload_colour(*stage.thread, key, imagery).has_value());
    const DrawTile tile = draw_alone(key);
    FrameLook look;
    look.lighting = lighting;
    look.to_sun = geo::enu_at(geo::kWgs84, {})(geo::Vector<geo::Enu>{glm::dvec3(std::sin(sun_from_zenith), 0.0, std::cos(sun_from_zenith))});
    return pixel(stage.picture(camera_at("-0.5,0.5,50000"), look, {&tile, 1}), kWidth / 2, kHeight / 2);
  };
  constexpr std::array<std::uint8_t, 4> kDark{0, 0, 0, 255}, kLamp{255, 128, 0, 255}, kSea{255, 255, 255, 255};
  constexpr double kNoon = 0.0, kMorning = 1.0, kMidnight = 3.0;
  CHECK(shown(kLamp, kDark, kMorning) == shown(kDark, kDark, kMorning));
  const auto lit = shown(kLamp, kDark, kMidnight), dark = shown(kDark, kDark, kMidnight);
  CHECK(lit[0] > 200);
  CHECK(lit[1] > dark[1] + 60);
  CHECK(lit[2] == dark[2]);
  CHECK(shown(kDark, kSea, kNoon)[0] > shown(kDark, kDark, kNoon)[0] + 40);
  CHECK(shown(kDark, kSea, kMorning) == shown(kDark, kDark, kMorning));
  CHECK(shown(kDark, kSea, kMidnight) == shown(kDark, kDark, kMidnight));
  CHECK(shown(kLamp, kSea, kMidnight, false) == shown(kDark, kDark, kMidnight, false));
}

TEST_CASE("picture: an overlay lies over ground and night alike, and light changes nothing of it") {
  const geo::TileKey key{0, 6, 32, 32};
  for (const auto& [api, without] : {std::pair(gpu::Api::core, ""), {gpu::Api::es, "clip_control"}}) {
    Stage stage(api, without, {.ellipsoid = geo::kWgs84, .air = std::nullopt, .slots = {.overlays = true}});
    REQUIRE(stage.renderer->upload_geometry(*stage.thread, key, exact_geometry(geo::kWgs84, key, flat)).has_value());
    const auto shown = [&](std::array<std::uint8_t, 4> overlay, double sun_from_zenith, bool night_too = false) {
      auto imagery = exact_imagery(key, [](const auto&) { return glm::dvec3(0.2); });
      auto patch = imagery.patches.front();
      patch.opaque = overlay[3] == 255;
      patch.image = {1, 1, {overlay.begin(), overlay.end()}};
      if (overlay[3] != 0) imagery.overlays = {patch};
      patch.use = surface::ImageUse::night;
      if (night_too) imagery.effects = {patch};
      REQUIRE(stage.renderer->upload_colour(*stage.thread, key, imagery).has_value());
      const DrawTile tile = draw_alone(key);
      FrameLook look;
      look.to_sun = geo::enu_at(geo::kWgs84, {})(geo::Vector<geo::Enu>{glm::dvec3(std::sin(sun_from_zenith), 0.0, std::cos(sun_from_zenith))});
      return pixel(stage.picture(camera_at("-0.5,0.5,50000"), look, {&tile, 1}), kWidth / 2, kHeight / 2);
    };
    constexpr std::array<std::uint8_t, 4> kNothing{0, 0, 0, 0}, kSign{40, 150, 220, 255}, kHalf{20, 75, 110, 128};
    constexpr double kMorning = 1.0, kMidnight = 3.0;
    for (const double sun : {kMorning, kMidnight}) {
      for (const bool night_too : {false, true}) {
        const auto sign = shown(kSign, sun, night_too);
        for (int c = 0; c < 3; ++c) CHECK(std::abs(int{sign[c]} - int{kSign[c]}) <= 1);
      }
      const auto plain = shown(kNothing, sun), half = shown(kHalf, sun);
      for (int c = 0; c < 3; ++c) CHECK(std::abs(half[c] - (kHalf[c] + plain[c] * 127 / 255)) <= 1);
    }
    CHECK(shown(kNothing, kMorning) != shown(kNothing, kMidnight));
  }
}

TEST_CASE("picture: normals in the frame of east, north and up shade as the same slopes of the elevation do, unless these are finer") {
  for (const auto& [api, without] : {std::pair(gpu::Api::core, ""), {gpu::Api::es, "clip_control"}}) {
    // One tile on the equator, whose slopes run to the east and the south, and one round the north pole.
    for (const char* pose : {"-0.5,0.5,50000", "78.5,140,50000"}) {
      Stage stage(api, without, {.ellipsoid = geo::kWgs84, .air = std::nullopt, .slots = {.normals = true}});
      const view::Camera camera = camera_at(pose);
      const geo::Geodetic below = geo::to_geodetic(geo::kWgs84, camera.eye);
      const geo::TileKey key = geo::tile_at(geo::normal_at({below.latitude, below.longitude}), 6);
      CAPTURE(geo::to_string(key));
      const auto shown = [&](glm::dvec2 rise, bool by_normals, float spacing = 1.0f) {  // rise to the east and to the north
        auto geometry = exact_geometry(geo::kWgs84, key, flat);
        // Along the slope map's own axes at the place that is looked at.
        const auto from_enu = geo::enu_at(geo::kWgs84, below);
        const glm::dvec3 up = from_enu(geo::Vector<geo::Enu>{{0, 0, 1}}).xyz, along = from_enu(geo::Vector<geo::Enu>{{rise.x, rise.y, 0}}).xyz;
        const glm::dvec3 tangent = geometry.slopes.tangent.xyz, tu = glm::normalize(tangent - glm::dot(tangent, up) * up), tv = glm::cross(tu, up);
        const glm::vec2 slope = by_normals ? glm::vec2(0.7f, -0.4f) : glm::vec2(glm::dot(along, tu), glm::dot(along, tv));
        geometry.slopes.slopes.assign(surface::kSlopeSlotSide * surface::kSlopeSlotSide, slope);
        REQUIRE(stage.renderer->upload_geometry(*stage.thread, key, geometry).has_value());
        auto imagery = exact_imagery(key, [](const auto&) { return glm::dvec3(0.8); });
        if (by_normals) {
          const glm::dvec3 normal = glm::normalize(glm::dvec3(-rise.x, -rise.y, 1.0));
          auto patch = imagery.patches.front();
          patch.use = surface::ImageUse::normal;
          patch.image = {1, 1, {}};
          for (int c = 0; c < 3; ++c) patch.image.rgba.push_back(static_cast<std::uint8_t>(std::lround((normal[c] + 1.0) / 2.0 * 255.0)));
          patch.image.rgba.push_back(255);
          imagery.normals = {patch};
          imagery.normals_spacing = spacing;
        }
        REQUIRE(stage.renderer->upload_colour(*stage.thread, key, imagery).has_value());
        const DrawTile tile = draw_alone(key);
        FrameLook look;
        look.to_sun = from_enu(geo::Vector<geo::Enu>{glm::normalize(glm::dvec3(0.6, 0.3, 1.0))});
        return int{pixel(stage.picture(camera, look, {&tile, 1}), kWidth / 2, kHeight / 2)[0]};
      };
      for (const glm::dvec2 rise : {glm::dvec2(0.0), {0.5, 0.0}, {-0.5, 0.0}, {0.0, 0.5}, {0.0, -0.5}, {0.3, -0.6}}) {
        CAPTURE(rise.x);
        CAPTURE(rise.y);
        CHECK(std::abs(shown(rise, true) - shown(rise, false)) <= 1);
      }
      CHECK(shown({-0.5, 0.0}, true) > shown({0.5, 0.0}, true) + 30);
      CHECK(shown({-0.5, 0.0}, true, 1e6f) == shown({0.5, 0.0}, true, 1e6f));
    }
  }
}

TEST_CASE("measure: heights, places and distances agree with the analytic ellipsoid") {
  struct View {
    const char* pose;
    int level;
    int reach;
    double height_tolerance_m;  // curvature between the grid's points, plus 1 mm
  };
  // A grid of 2^-(level + 6) quarter circles deviates by (10^7 m / 2^(level + 6))^2 / 8 / 6.4e6 m and 40 % more (diagonals).
  const View views[] = {{"47,8,2,30,-40", 15, 1, 0.001}, {"47,8,2,30,-3", 12, 1, 0.002}, {"-33,151,1500,200,-30", 11, 2, 0.004},
                        {"12,20,40000,10,-60", 7, 1, 0.9}};
  for (const auto& [api, without] : {std::pair(gpu::Api::core, ""), {gpu::Api::es, "clip_control"}}) {
    Stage stage(api, without);
    for (const View& v : views) {
      INFO(v.pose, ", OpenGL ES: ", stage.thread->capabilities().is_es);
      const view::Camera camera = camera_at(v.pose);
      const auto place = geo::place_of(view::parse_pose(v.pose)->position);
      std::vector<DrawTile> tiles;
      for (const geo::TileKey& key : tiles_round(place, v.level, v.reach)) {
        REQUIRE(stage.renderer->upload_geometry(*stage.thread, key, exact_geometry(geo::kWgs84, key, flat)).has_value());
        tiles.push_back(draw_alone(key));
      }
      const GeoPicture geo = stage.measure(camera, bare_look(), tiles);
      int hits = 0;
      double worst_height = 0;
      double worst_place_px = 0;
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const auto i = static_cast<std::size_t>(y * kWidth + x);
          if (std::isnan(geo.distance[i])) continue;
          ++hits;
          worst_height = std::max(worst_height, std::abs(geo.elevation[i]));
          const auto point = geo::to_ecef(geo::kWgs84, {to_radians(Degrees(geo.latitude[i])), to_radians(Degrees(geo.longitude[i])),
                                                        EllipsoidalHeight(geo.elevation[i])});
          const geo::Vector<geo::Ecef> ray = camera.ray({x + 0.5, y + 0.5});
          const glm::dvec3 off = (point - camera.eye).xyz / geo.distance[i] - ray.xyz;
          worst_place_px = std::max(worst_place_px, glm::length(off) / camera.pixel_angle());
        }
      }
      CHECK(hits > kWidth * kHeight / 3);
      CHECK(worst_height < v.height_tolerance_m);
      CHECK(worst_place_px < 0.01);
      // Row 0 is on top: in the middle column the distance grows upwards.
      CHECK(geo.distance[static_cast<std::size_t>((kHeight - 1) * kWidth + kWidth / 2)] <
            geo.distance[static_cast<std::size_t>((kHeight * 3 / 4) * kWidth + kWidth / 2)]);
      for (const DrawTile& tile : tiles) stage.renderer->release(*stage.thread, tile.key, surface::Part::geometry);
    }
  }
}

TEST_CASE("measure: exaggeration, morph and skirts move the surface as they say") {
  Stage stage(gpu::Api::core);
  const auto hill = [](const geo::Vector<geo::Ecef>&) { return 1200.0; };
  const geo::TileKey key = geo::tile_at(geo::normal_at({to_radians(Degrees(10.2)), to_radians(Degrees(20.1))}), 9);
  auto geometry = exact_geometry(geo::kWgs84, key, hill);
  for (auto& v : geometry.mesh.vertices) v.parent_height = v.height + 100.0f;
  REQUIRE(stage.renderer->upload_geometry(*stage.thread, key, geometry).has_value());
  DrawTile tile = draw_alone(key);
  const view::Camera camera = camera_at("10.2,20.1,9000");
  const auto middle_height = [&](double exaggeration) {
    FrameLook look = bare_look();
    look.exaggeration = exaggeration;
    return stage.measure(camera, look, {&tile, 1}).elevation[static_cast<std::size_t>(kHeight / 2 * kWidth + kWidth / 2)];
  };
  CHECK(middle_height(1.0) == doctest::Approx(1200.0).epsilon(1e-5));
  CHECK(middle_height(3.0) == doctest::Approx(3600.0).epsilon(1e-5));
  CHECK(middle_height(0.0) == doctest::Approx(0.0).epsilon(1e-2));
  tile.morph = 0.25f;
  CHECK(middle_height(2.0) == doctest::Approx(2 * 1275.0).epsilon(1e-5));
  tile.morph = 1.0f;
  // Down to the level, but not by more than the depth.
  tile.sink_depth = 500.0f;
  tile.sink_level = 2000.0f;
  CHECK(middle_height(2.0) == doctest::Approx(2000.0).epsilon(1e-5));
  tile.sink_level = 1000.0f;
  CHECK(middle_height(2.0) == doctest::Approx(1900.0).epsilon(1e-5));
  tile.sink_level = 5000.0f;
  CHECK(middle_height(2.0) == doctest::Approx(2400.0).epsilon(1e-5));
  tile.sink_depth = 0.0f;
  for (auto& v : geometry.mesh.vertices) v.skirt = surface::kSkirtRim;
  tile.skirt_depth = 30.0f;
  REQUIRE(stage.renderer->upload_geometry(*stage.thread, key, geometry).has_value());
  CHECK(middle_height(1.0) == doctest::Approx(1170.0).epsilon(1e-3));
}

TEST_CASE("upload: what does not fit the budget is refused, and fits after a release") {
  constexpr std::size_t kBudget = std::size_t{24} << 20;
  Stage stage(gpu::Api::core, "", {.ellipsoid = geo::kWgs84, .gpu_budget_bytes = kBudget});
  CHECK(stage.renderer->gpu_budget_bytes() == kBudget);
  auto geometry = exact_geometry(geo::kWgs84, {}, flat);
  geometry.slopes.slopes.resize(surface::kSlopeSlotSide * surface::kSlopeSlotSide);
  const auto imagery = exact_imagery({}, [](const auto&) { return glm::dvec3(0.5); });
  const std::vector<geo::TileKey> keys = tiles_of_level(3);

  const std::size_t free_before = stage.renderer->colour_slots_free();
  std::size_t colours = 0;
  while (colours < keys.size()) {
    const auto uploaded = stage.renderer->upload_colour(*stage.thread, keys[colours], imagery);
    if (!uploaded) {
      CHECK(uploaded.error().code == ErrorCode::exhausted);
      break;
    }
    ++colours;
  }
  CHECK(colours == free_before);
  CHECK(colours > 10);
  CHECK(stage.renderer->colour_slots_free() == 0);
  stage.renderer->release(*stage.thread, keys[3], surface::Part::colour);
  CHECK(stage.renderer->colour_slots_free() == 1);
  CHECK(stage.renderer->upload_colour(*stage.thread, keys[colours], imagery).has_value());

  std::size_t meshes = 0;
  while (meshes < keys.size() && stage.renderer->upload_geometry(*stage.thread, keys[meshes], geometry)) ++meshes;
  CHECK(meshes > 2);  // colours leave room for geometry
  CHECK(meshes < keys.size());
  CHECK(stage.renderer->gpu_bytes() <= kBudget);
  const std::size_t full = stage.renderer->gpu_bytes();
  stage.renderer->release(*stage.thread, keys[0], surface::Part::geometry);
  CHECK(full - stage.renderer->gpu_bytes() == geometry.mesh.bytes());
  CHECK(stage.renderer->upload_geometry(*stage.thread, keys[meshes], geometry).has_value());
  CHECK(stage.renderer->bytes_uploaded() > kBudget / 2);
}

TEST_CASE("upload: what colours took goes to meshes when nothing shows it any more, and back") {
  Stage stage(gpu::Api::core, "", {.ellipsoid = geo::kWgs84, .gpu_budget_bytes = std::size_t{24} << 20});
  auto geometry = exact_geometry(geo::kWgs84, {}, flat);
  const auto imagery = exact_imagery({}, [](const auto&) { return glm::dvec3(0.5); });
  const std::vector<geo::TileKey> keys = tiles_of_level(4);
  const auto fill = [&](surface::Part part) {
    std::size_t count = 0;
    while (count < keys.size() && (part == surface::Part::colour ? stage.renderer->upload_colour(*stage.thread, keys[count], imagery)
                                                                 : stage.renderer->upload_geometry(*stage.thread, keys[count], geometry))) {
      ++count;
    }
    return count;
  };
  const auto empty = [&](surface::Part part, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) stage.renderer->release(*stage.thread, keys[i], part);
    stage.thread->empty_graveyard();
  };
  const std::size_t all_colours = fill(surface::Part::colour);
  REQUIRE(all_colours > 10);
  const std::size_t beside = fill(surface::Part::geometry);
  empty(surface::Part::geometry, beside);
  empty(surface::Part::colour, all_colours);
  const std::size_t all_meshes = fill(surface::Part::geometry);
  CHECK(all_meshes > 3 * beside);  // colours may take 0.7 of the budget
  empty(surface::Part::geometry, all_meshes);
  CHECK(fill(surface::Part::colour) == all_colours);
}

TEST_CASE("upload: a part that is there already is replaced") {
  Stage stage(gpu::Api::core);
  const geo::TileKey key{};
  const auto geometry = exact_geometry(geo::kWgs84, key, flat);
  REQUIRE(stage.renderer->upload_geometry(*stage.thread, key, geometry).has_value());
  const auto colour = [](double v) { return [v](const geo::Vector<geo::Ecef>&) { return glm::dvec3(v); }; };
  REQUIRE(stage.renderer->upload_colour(*stage.thread, key, exact_imagery(key, colour(0.2))).has_value());
  const std::size_t bytes = stage.renderer->gpu_bytes();
  REQUIRE(stage.renderer->upload_geometry(*stage.thread, key, geometry).has_value());
  REQUIRE(stage.renderer->upload_colour(*stage.thread, key, exact_imagery(key, colour(0.8))).has_value());
  CHECK(stage.renderer->gpu_bytes() == bytes);
  const DrawTile tile = draw_alone(key);
  const auto c = pixel(stage.picture(camera_at("0,0,1000000"), bare_look(), {&tile, 1}), kWidth / 2, kHeight / 2);
  CHECK(std::abs(c[0] - 204) <= 1);
}

TEST_CASE("upload: new colours fade over those that were there, and then these are gone") {
  Stage stage(gpu::Api::core);
  const geo::TileKey key{};
  REQUIRE(stage.renderer->upload_geometry(*stage.thread, key, exact_geometry(geo::kWgs84, key, flat)).has_value());
  const auto colour = [](double v) { return [v](const geo::Vector<geo::Ecef>&) { return glm::dvec3(v); }; };
  const DrawTile tile = draw_alone(key);
  const auto shown = [&] { return pixel(stage.picture(camera_at("0,0,1000000"), bare_look(), {&tile, 1}), kWidth / 2, kHeight / 2)[0]; };
  REQUIRE(stage.renderer->upload_colour(*stage.thread, key, exact_imagery(key, colour(0.2)), true).has_value());
  CHECK(std::abs(shown() - 51) <= 1);  // there was nothing to fade from
  REQUIRE(stage.renderer->upload_colour(*stage.thread, key, exact_imagery(key, colour(0.8)), true).has_value());
  CHECK(std::abs(shown() - 51) <= 1);
  const std::size_t free_slots = stage.renderer->colour_slots_free();
  stage.renderer->advance_renewals(*stage.thread, 0.5f);
  CHECK(std::abs(shown() - 128) <= 2);
  stage.renderer->advance_renewals(*stage.thread, 0.6f);
  CHECK(std::abs(shown() - 204) <= 1);
  CHECK(stage.renderer->colour_slots_free() == free_slots + 1);
  // Without a fade, and when the tile goes in the middle of one, nothing is left behind.
  REQUIRE(stage.renderer->upload_colour(*stage.thread, key, exact_imagery(key, colour(0.4))).has_value());
  CHECK(std::abs(shown() - 102) <= 1);
  REQUIRE(stage.renderer->upload_colour(*stage.thread, key, exact_imagery(key, colour(0.2)), true).has_value());
  stage.renderer->release(*stage.thread, key, surface::Part::colour);
  CHECK(stage.renderer->colour_slots_free() == free_slots + 2);
  stage.renderer->advance_renewals(*stage.thread, 0.5f);
}

TEST_CASE("draw: lines, boxes, borders and smooth edges show, and go again") {
  for (const auto& [api, without] : {std::pair(gpu::Api::core, ""), {gpu::Api::es, "clip_control"}}) {
    Stage stage(api, without);
    const auto tiles = upload_level(*stage.thread, *stage.renderer, geo::kWgs84, 1, flat, checker, 64);
    const view::Camera camera = camera_at("30,20,9000000");
    const auto plain = stage.picture(camera, bare_look(), tiles);
    const auto share = [&](bool FrameLook::* feature) {
      FrameLook look = bare_look();
      look.*feature = true;
      return compare(plain, stage.picture(camera, look, tiles)).share_beyond_5;
    };
    CHECK(share(&FrameLook::wireframe) > 0.2);
    CHECK(share(&FrameLook::bounds) > 0.005);
    CHECK(share(&FrameLook::tile_borders) > 0.005);
    CHECK(share(&FrameLook::antialiasing) > 0.005);
    CHECK(compare(plain, stage.picture(camera, bare_look(), tiles)).largest == 0);
  }
}

TEST_CASE("draw: the sky is blue by day, black by night, and ends in space") {
  Stage stage(gpu::Api::core);
  const auto sky = [&](const char* pose, const glm::dvec3& sun) {
    FrameLook look;
    look.to_sun = {sun};
    return pixel(stage.picture(camera_at(pose), look, {}), kWidth / 2, 5);
  };
  const auto noon = sky("0,0,100,0,30", {1, 0, 0});
  CHECK(noon[2] > noon[1]);
  CHECK(noon[1] > noon[0]);
  CHECK(noon[2] > 90);
  const auto night = sky("0,0,100,0,30", {-1, 0, 0});
  CHECK(*std::max_element(night.begin(), night.end()) <= 2);
  const auto space = sky("0,0,20000000,0,-90", {1, 0, 0});
  CHECK(*std::max_element(space.begin(), space.end()) == 0);
}
