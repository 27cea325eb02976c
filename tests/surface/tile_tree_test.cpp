#include "surface/tile_tree.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

#include "surface/selection_wanted.h"
#include "surface/selection_world.h"
#include "surface/tile_bounds.h"

using namespace tellurion;
using namespace tellurion::surface;
using namespace tellurion::surface::testing;

namespace {

/// What a finished cut has to be, said as plainly as possible: recursion from the roots, every number computed afresh.
class ReferenceCut {
 public:
  ReferenceCut(const EvenPlanet& planet, const view::Camera& camera, const SelectionSettings& settings)
      : planet_(planet), camera_(camera), settings_(settings), volume_(make_view_volume(camera)),
        horizon_(horizon_of(planet, camera, settings)) {}

  /// Drawn tiles with their colour and slope owners.
  std::map<geo::TileKey, std::pair<geo::TileKey, geo::TileKey>> find(double sse_px) {
    sse_px_ = sse_px;
    found_.clear();
    for (std::uint8_t face = 0; face < geo::kFaceCount; ++face) visit({face, 0, 0, 0}, {}, {}, false);
    return found_;
  }

 private:
  /// That of the ground in sight, which has tests of its own.
  static Horizon horizon_of(const EvenPlanet& planet, const view::Camera& camera, const SelectionSettings& settings) {
    NodePool pool(planet.ellipsoid, std::make_shared<EvenPlanet>(planet));
    return make_frame(pool, camera, settings, 1, 0, {}).horizon;
  }

  /// `fine_enough`: an ancestor's texels are within the wanted error, and its slot serves all below it.
  void visit(const geo::TileKey& key, geo::TileKey colour, geo::TileKey slopes, bool fine_enough) {
    const TileFacts facts = planet_.facts_of(key);
    const TileMetrics built = planet_.metrics_of(key);
    const double x = settings_.exaggeration;
    const bool tabled = facts.height_error.has_value();
    const double low = (tabled ? facts.min_height : std::max(built.min_height, facts.min_height)) * x;
    const double high = (tabled ? facts.max_height : std::min(built.max_height, facts.max_height)) * x;
    const OrientedBox box = tile_box(planet_.ellipsoid, key, low, high);
    if (!planes_crossed(volume_, box, kAllPlanes) || horizon_.hides(box)) return;
    if ((facts.own_colour && !fine_enough) || key.level == 0) colour = key;
    if (key.level == 0 || (facts.own_slopes && planet_.has_slopes(key))) slopes = key;

    // Metres, then pixels.
    const TileShape shape = tile_shape(planet_.ellipsoid, key);
    const double a = planet_.ellipsoid.a();
    const auto geometric = [&](double height, double curve, double top) { return height * x + curve * (1 + x * top / a); };
    const auto height_of = [](const HeightError& e) { return std::max(static_cast<double>(e.common), static_cast<double>(e.bound) / 2); };
    const double sag = shape.grid_diagonal * shape.grid_diagonal / 8 * a / (planet_.ellipsoid.b() * planet_.ellipsoid.b());
    double metres = std::max(4e-7 * shape.size, geometric(height_of(built.steps[0].height), built.steps[0].curvature, built.max_height));
    if (tabled) metres = std::max(metres, geometric(height_of(*facts.height_error), sag, facts.max_height));
    const double pixel = std::max(distance_to(box, camera_.eye.xyz), 0.1) * camera_.pixel_angle();
    double error = metres / pixel;
    if (facts.finer_colour_below && !fine_enough) {
      const glm::dvec3 to_eye = camera_.eye.xyz - box.centre;
      const double radius = glm::length(box.half) / glm::length(to_eye);
      double share = 1;
      if (radius < 1) {
        const double angle = std::acos(glm::dot(to_eye, shape.up) / glm::length(to_eye));
        const double spread = shape.cone + std::atan((high - low) / (shape.size / 2)) + std::asin(radius);
        share = std::clamp(settings_.anisotropy * std::cos(std::max(angle - spread, 0.0)), 0.0, 1.0);
      }
      const double texel = shape.size / 248 / pixel * share;
      error = std::max(error, texel);
      fine_enough = texel <= settings_.sse_px;
    }
    if (error > sse_px_ && key.level < geo::kMaxTileLevel) {
      for (int i = 0; i < 4; ++i) visit(geo::child(key, i), colour, slopes, fine_enough);
    } else {
      found_[key] = {colour, slopes};
    }
  }

  const EvenPlanet& planet_;
  view::Camera camera_;
  SelectionSettings settings_;
  ViewVolume volume_;
  Horizon horizon_;
  double sse_px_ = 1;
  std::map<geo::TileKey, std::pair<geo::TileKey, geo::TileKey>> found_;
};

/// How often the drawn tiles cover the ground that is seen at a point of the picture; nothing for sky.
std::optional<int> times_covered(const geo::Ellipsoid& ellipsoid, const view::Camera& camera, const Selection& selection,
                                 glm::dvec2 pixel) {
  const geo::Vector<geo::Ecef> ray = camera.ray(pixel);
  const double distance = geo::intersect_ray(ellipsoid, Metres(0), camera.eye, ray);
  if (distance < 0) return std::nullopt;
  const geo::Geodetic ground = geo::to_geodetic(ellipsoid, camera.eye + ray * distance);
  const geo::TileKey spot = geo::tile_at(geo::normal_at(geo::place_of(ground)), geo::kMaxTileLevel);
  return static_cast<int>(
      std::ranges::count_if(selection.draw, [&](const DrawTile& tile) { return geo::contains(tile.key, spot); }));
}

std::string text_of(const Selection& selection) {
  std::string text;
  for (const DrawTile& tile : selection.draw) {
    text += geo::to_string(tile.key) + ' ' + geo::to_string(tile.colour_owner) + ' ' + geo::to_string(tile.slope_owner) + ' ' +
            std::to_string(tile.fade) + ' ' + std::to_string(tile.morph) + ' ' + std::to_string(tile.skirt_depth) + ' ' +
            std::to_string(tile.error_px) + ' ' + std::to_string(tile.distance) + ' ' + std::to_string(tile.step) + '\n';
  }
  return text;
}

}  // namespace

TEST_CASE("select: the finished cut is the one of a plain recursion, over facts, below them and with exaggeration") {
  const std::uint64_t seed = 31;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 60; ++i) {
    EvenPlanet planet;
    planet.ellipsoid = i % 3 == 0 ? geo::kMars : geo::kWgs84;
    planet.table_level = i % 2 == 0 ? 30 : 5;
    planet.colour_level = static_cast<int>(random() % 12);
    SelectionSettings settings;
    settings.sse_px = i % 5 == 0 ? 4 : 2;
    settings.exaggeration = i % 4 == 0 ? 20 : 1;
    settings.anisotropy = i % 7 == 0 ? 8 : 1;
    settings.max_tiles = 100000;
    const view::Camera camera = random_camera(planet.ellipsoid, random, 3000);
    Flight flight(planet, random());
    const Selection* selection = flight.finish(camera, settings);
    REQUIRE(selection != nullptr);
    const auto expected = ReferenceCut(planet, camera, settings).find(settings.sse_px);
    CHECK(selection->draw.size() == expected.size());
    for (const DrawTile& tile : selection->draw) {
      CAPTURE(geo::to_string(tile.key));
      const auto found = expected.find(tile.key);
      REQUIRE(found != expected.end());
      CHECK(tile.colour_owner == found->second.first);
      CHECK(tile.slope_owner == found->second.second);
      CHECK(tile.fade == 1);
      CHECK(tile.morph == 1);
      CHECK(tile.error_px <= settings.sse_px);
    }
  }
}

TEST_CASE("select: in every frame of any loading the drawn tiles cover what is seen exactly once") {
  const std::uint64_t seed = 5;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<> unit(0, 1);
  int seen = 0;
  for (int i = 0; i < 24; ++i) {
    EvenPlanet planet;
    planet.relief = i % 3 == 0 ? 0 : 4000;
    planet.table_level = i % 2 == 0 ? 30 : 4;
    Flight flight(planet, random(), 0.2);
    SelectionSettings settings;
    settings.sse_px = 3;
    settings.transitions = i % 4 >= 2;
    settings.exaggeration = i % 5 == 0 ? 100 : 1;
    view::Camera camera = random_camera(planet.ellipsoid, random, 2000);
    for (int frame = 0; frame < 60; ++frame) {
      if (frame % 12 == 0) camera = random_camera(planet.ellipsoid, random, 20000);
      camera.eye.xyz *= 1.0 + 0.01 * unit(random);
      const Selection& selection = flight.frame(camera, settings, 12, 8);
      for (const Part part : {Part::geometry, Part::colour}) {  // a tight budget on top
        for (int drops = 0; drops < 3; ++drops) {
          if (const auto key = flight.tree.eviction_candidate(part)) flight.tree.released(*key, part);
        }
      }
      for (int point = 0; point < 40; ++point) {
        const auto times = times_covered(planet.ellipsoid, camera, selection, {1280 * unit(random), 720 * unit(random)});
        if (!times) continue;
        ++seen;
        REQUIRE(*times == 1);
      }
    }
  }
  CHECK(seen > 20000);
}

TEST_CASE("select: until the picture is complete, roots lie as a floor under every ray that meets the deepest ground") {
  const std::uint64_t seed = 6;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<> unit(0, 1);
  int seen = 0, complete = 0;
  for (int i = 0; i < 12; ++i) {
    const EvenPlanet planet;
    Flight flight(planet, random());
    SelectionSettings settings;
    settings.exaggeration = i % 3 == 0 ? 100 : 1;
    settings.sse_px = 8;
    const double lowest = settings.exaggeration * -planet.relief;
    const view::Camera camera = random_camera(planet.ellipsoid, random, 20000);
    for (int frame = 0; frame < 40; ++frame) {
      const Selection& selection = flight.frame(camera, settings, 40, 20);
      if (selection.stats.complete) {
        ++complete;
        REQUIRE(selection.floor.empty());
        continue;
      }
      for (const DrawTile& tile : selection.floor) {
        REQUIRE(tile.key.level == 0);
        REQUIRE(tile.sink_level == doctest::Approx(lowest));
        REQUIRE(tile.sink_depth >= settings.exaggeration * 0.9 * planet.relief - lowest);
      }
      for (int point = 0; point < 40; ++point) {
        const geo::Vector<geo::Ecef> ray = camera.ray({1280 * unit(random), 720 * unit(random)});
        const double distance = geo::intersect_ray(planet.ellipsoid, Metres(lowest), camera.eye, ray);
        if (distance < 0) continue;
        const geo::Geodetic hit = geo::to_geodetic(planet.ellipsoid, camera.eye + ray * distance);
        const int face = geo::face_point(geo::normal_at(geo::place_of(hit))).face;
        REQUIRE(std::ranges::count(selection.floor, face, [](const DrawTile& tile) { return static_cast<int>(tile.key.face); }) == 1);
        ++seen;
      }
    }
  }
  CHECK(seen > 500);
  CHECK(complete > 0);
}

TEST_CASE("select: a finished picture does not depend on the way there") {
  const std::uint64_t seed = 77;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (int place = 0; place < 8; ++place) {
    EvenPlanet planet;
    planet.table_level = place % 2 == 0 ? 30 : 3;
    SelectionSettings settings;
    settings.max_tiles = place % 4 < 2 ? 2000 : 60;
    settings.exaggeration = place % 3 == 0 ? 30 : 1;
    const view::Camera goal = random_camera(planet.ellipsoid, random, 500);
    std::string first;
    for (int way = 0; way < 4; ++way) {
      Flight flight(planet, random(), way == 3 ? 0.3 : 0);
      for (int frame = 0; frame < 40 * way; ++frame) {
        view::Camera camera = frame % 10 == 0 ? random_camera(planet.ellipsoid, random, 500) : goal;
        camera.eye.xyz *= 1 + 0.001 * way;
        flight.frame(camera, settings, 20, 20);
      }
      const Selection* selection = flight.finish(goal, settings);
      REQUIRE(selection != nullptr);
      if (way == 0) first = text_of(*selection);
      CHECK(text_of(*selection) == first);
    }
  }
}

TEST_CASE("select: a tile is drawn by its coarsest triangulation that is good enough") {
  std::mt19937_64 random(7);
  std::array<int, 3> drawn{};
  for (int i = 0; i < 20; ++i) {
    EvenPlanet planet;
    planet.colour_level = 10;
    SelectionSettings settings;
    const view::Camera camera = random_camera(planet.ellipsoid, random, 3000);
    Flight flight(planet, random());
    const Selection* selection = flight.finish(camera, settings);
    REQUIRE(selection != nullptr);
    for (const DrawTile& tile : selection->draw) {
      const TileMetrics metrics = planet.metrics_of(tile.key);
      const auto px = [&](std::size_t step) {
        const MeshError& e = metrics.steps[step];
        const double raised = 1 + static_cast<double>(metrics.max_height) / planet.ellipsoid.a();
        const double height = std::max(static_cast<double>(e.height.common), static_cast<double>(e.height.bound) / 2);
        return (height + static_cast<double>(e.curvature) * raised) / (tile.distance * camera.pixel_angle());
      };
      ++drawn[tile.step];
      if (tile.step > 0) CHECK(px(tile.step) <= settings.sse_px);
      if (tile.step < 2) CHECK(px(tile.step + 1u) > settings.sse_px);
      CHECK(static_cast<double>(tile.error_px) >= px(tile.step) * 0.999);
    }
  }
  for (const int count : drawn) CHECK(count > 0);
}

TEST_CASE("select: colours on the way to finer ones are asked for only where these let themselves wait") {
  EvenPlanet planet;
  planet.colour_level = 12;
  const view::Camera camera = camera_at(planet.ellipsoid, 40, 50, 5000, 30, -20);
  const SelectionSettings settings;
  const auto wanted = ReferenceCut(planet, camera, settings).find(settings.sse_px);
  std::set<geo::TileKey> owners;
  for (const auto& [key, of] : wanted) owners.insert(of.first);
  Flight flight(planet);
  const auto asked_on_the_way = [&] {
    return std::ranges::count_if(flight.frame(camera, settings, 0, 0).requests, [&](const TileRequest& request) { return request.part == Part::colour && !owners.contains(request.key); });
  };
  for (int frame = 0; frame < 1900 / kFrameTime.count(); ++frame) REQUIRE(asked_on_the_way() == 0);
  for (int frame = 0; frame < 200 / kFrameTime.count(); ++frame) flight.frame(camera, settings, 0, 0);
  CHECK(asked_on_the_way() > 0);
  REQUIRE(flight.finish(camera, settings) != nullptr);
  CHECK(asked_on_the_way() == 0);
}

TEST_CASE("select: the wanted error rises by the least step that keeps to max_tiles") {
  const std::uint64_t seed = 123;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 10; ++i) {
    EvenPlanet planet;
    const view::Camera camera = random_camera(planet.ellipsoid, random, 5000);
    SelectionSettings settings;
    settings.max_tiles = 40;
    Flight flight(planet, random());
    const Selection* selection = flight.finish(camera, settings);
    REQUIRE(selection != nullptr);
    ReferenceCut reference(planet, camera, settings);
    double sse = settings.sse_px;
    while (reference.find(sse).size() > settings.max_tiles) sse *= 1.25;
    CHECK(selection->stats.effective_sse_px == doctest::Approx(sse).epsilon(1e-9));
    CHECK(selection->draw.size() == reference.find(sse).size());
  }
}

TEST_CASE("select: the poles cost what the equator costs") {
  // Issue point c: over 50 headings and an octave of heights at 89.95 N and at the equator.
  EvenPlanet planet;
  planet.colour_level = 9;
  const auto counts = [&](double lat) {
    std::vector<int> sizes;
    Flight flight(planet);
    for (int i = 0; i < 50; ++i) {
      const double height = 50000 * std::exp2(i / 50.0);
      const Selection* selection =
          flight.finish(camera_at(planet.ellipsoid, lat, 0.05, height, 7.2 * i, -30), SelectionSettings{});
      REQUIRE(selection != nullptr);
      sizes.push_back(selection->stats.tiles_drawn);
    }
    return sizes;
  };
  std::vector<int> pole = counts(89.95);
  std::vector<int> equator = counts(0.05);
  for (std::size_t i = 0; i < pole.size(); ++i) CHECK(pole[i] <= 1.5 * equator[i]);
  std::ranges::sort(pole);
  std::ranges::sort(equator);
  CHECK(pole[25] <= 1.1 * equator[25]);
  MESSAGE("median tiles at the pole " << pole[25] << ", at the equator " << equator[25]);
}

TEST_CASE("select: skirts reach below what neighbours can deviate by, and stay small") {
  const std::uint64_t seed = 17;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  int borders = 0;
  int uneven = 0;
  int sunk = 0;
  for (int i = 0; i < 20; ++i) {
    EvenPlanet planet;
    planet.root_error = 40000;
    planet.colour_level = 12;
    SelectionSettings settings;
    settings.exaggeration = i % 2 == 0 ? 1 : 10;
    const view::Camera camera = random_camera(planet.ellipsoid, random, 3000);
    Flight flight(planet, random());
    const auto error_of = [&](const DrawTile& tile) {
      const MeshError m = planet.metrics_of(tile.key).steps[tile.step];
      const double error = static_cast<double>(m.height.bound) * settings.exaggeration + static_cast<double>(m.curvature);
      // One that is near enough to hide the eye may be drawn lower by its error, all others are not.
      if (tile.distance < 0.999 * error) {
        CHECK(static_cast<double>(tile.sink_depth) >= 0.999 * error);
        CHECK(static_cast<double>(tile.sink_level) < geo::to_geodetic(planet.ellipsoid, camera.eye).height.value);
      }
      if (static_cast<double>(tile.sink_depth) > 0) ++sunk;
      return error + static_cast<double>(tile.sink_depth);
    };
    for (int frame = 0; frame < 30; ++frame) {  // in mid-load, where neighbours differ most
      const Selection& selection = flight.frame(camera, settings, 15, 10);
      double largest = 0;
      for (const DrawTile& tile : selection.draw) largest = std::max(largest, error_of(tile));
      for (const DrawTile& tile : selection.draw) {
        CHECK(tile.skirt_depth > 0);
        const double own = error_of(tile) + 2 * camera.pixel_angle() * tile.distance;
        CHECK(tile.skirt_depth < (own + largest) * 1.1 + 1);
        for (const geo::Side side : {geo::Side::north, geo::Side::east, geo::Side::south, geo::Side::west}) {
          const geo::TileKey beyond = geo::neighbour(tile.key, side);
          for (const DrawTile& other : selection.draw) {
            // Touching: the neighbour's area lies in the other tile, or the other lies in it along the common border.
            bool touches = geo::contains(other.key, beyond);
            for (std::uint8_t back = 0; back < 4 && !touches; ++back) {
              if (geo::contains(beyond, other.key)) {
                touches = geo::contains(tile.key, geo::neighbour(other.key, static_cast<geo::Side>(back)));
              }
            }
            if (!touches) continue;
            ++borders;
            uneven += other.key.level != tile.key.level ? 1 : 0;
            CHECK(tile.skirt_depth >= (own + error_of(other)) * 0.999);
          }
        }
      }
    }
  }
  CHECK(borders > 1000);
  CHECK(uneven > 200);
  CHECK(sunk > 10);
}

TEST_CASE("select: requests are sorted by gain, unique, bounded, not started, and come again after a failure") {
  EvenPlanet planet;
  Flight flight(planet);
  const view::Camera camera = camera_at(planet.ellipsoid, 46.7, -121.76, 6500, 0, -10);
  const SelectionSettings settings;
  std::chrono::steady_clock::time_point now{};
  const std::vector<TileRequest> first = flight.tree.select(camera, settings, now).requests;
  REQUIRE(first.size() > 20);
  CHECK(first.size() <= 256);
  std::set<std::pair<geo::TileKey, Part>> unique;
  for (std::size_t i = 0; i < first.size(); ++i) {
    CHECK(unique.insert({first[i].key, first[i].part}).second);
    if (i > 0) CHECK(first[i].gain_px <= first[i - 1].gain_px);
    CHECK(flight.tree.is_wanted(first[i].key, first[i].part));
  }
  const auto asks_for = [&](const TileRequest& wanted) {
    return std::ranges::any_of(flight.tree.select(camera, settings, now).requests, [&](const TileRequest& r) {
      return r.key == wanted.key && r.part == wanted.part;
    });
  };
  flight.tree.started(first[0].key, first[0].part);
  CHECK_FALSE(asks_for(first[0]));
  CHECK(flight.tree.is_wanted(first[0].key, first[0].part));
  flight.tree.failed(first[0].key, first[0].part, now + std::chrono::seconds(1));
  CHECK_FALSE(asks_for(first[0]));
  now += std::chrono::seconds(1);
  CHECK(asks_for(first[0]));
  flight.tree.started(first[0].key, first[0].part);
  flight.tree.cancelled(first[0].key, first[0].part);
  CHECK(asks_for(first[0]));

  // Looking elsewhere, the request loses its use after some frames.
  const view::Camera elsewhere = camera_at(planet.ellipsoid, -46.7, 58, 6500, 0, -60);
  for (int i = 0; i < 5; ++i) flight.tree.select(elsewhere, settings, now);
  CHECK_FALSE(flight.tree.is_wanted(first[0].key, first[0].part));
}

TEST_CASE("select: levels that the facts describe are passed over, except for a step in every three") {
  EvenPlanet planet;
  Flight flight(planet);
  const view::Camera camera = camera_at(planet.ellipsoid, 20, 30, 30000, 0, -60);
  std::set<int> asked;
  while (!flight.tree.select(camera, SelectionSettings{}, flight.now).stats.complete) {
    for (const TileRequest& r : flight.frame(camera, SelectionSettings{}).requests) {
      if (r.part == Part::geometry) asked.insert(r.key.level);
    }
  }
  CHECK(asked.count(1) + asked.count(2) + asked.count(4) == 0);
  CHECK(asked.count(3) == 1);
}

TEST_CASE("select: what keeps a coarse tile in the picture is asked for before what only sharpens the view below it") {
  EvenPlanet planet;
  planet.colour_level = 0;
  Flight flight(planet);
  for (std::uint8_t face = 0; face < geo::kFaceCount; ++face) flight.loader.deliver({{face, 0, 0, 0}, Part::colour, 0});
  // From near the ground to the horizon: finest tiles in front, coarse ones far away, all below the same root.
  const view::Camera camera = camera_at(planet.ellipsoid, 20, 30, 30000, 0, -5);
  const std::vector<TileRequest> first = flight.frame(camera, SelectionSettings{}, 0, 0).requests;
  const geo::TileKey root = geo::ancestor(first.front().key, 0);
  const auto below = [&](const TileRequest& r) { return geo::contains(root, r.key); };
  const auto first_step = std::ranges::count_if(first, [&](const TileRequest& r) { return below(r) && r.key.level <= 3; });
  REQUIRE(first_step > 3);
  REQUIRE(first_step < std::ranges::count_if(first, below));
  const auto draws_root = [&](const Selection& selection) { return std::ranges::find(selection.draw, root, &DrawTile::key) != selection.draw.end(); };
  CHECK(draws_root(flight.frame(camera, SelectionSettings{}, 1, 1)));
  for (int i = 1; i < first_step; ++i) flight.frame(camera, SelectionSettings{}, 1, 1);
  CHECK_FALSE(draws_root(flight.frame(camera, SelectionSettings{}, 0, 0)));
}

TEST_CASE("eviction_candidate: never a tile of the last frame, never a root, children first, longest unused first") {
  const std::uint64_t seed = 8;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  EvenPlanet planet;
  Flight flight(planet);
  SelectionSettings settings;
  settings.sse_px = 4;
  const Selection* last = nullptr;
  for (int i = 0; i < 6; ++i) last = flight.finish(random_camera(planet.ellipsoid, random, 20000), settings);
  REQUIRE(last != nullptr);
  for (const Part part : {Part::geometry, Part::colour}) {
    std::set<geo::TileKey> gone;
    std::set<geo::TileKey> kept;
    for (const DrawTile& tile : last->draw) kept.insert(part == Part::geometry ? tile.key : tile.colour_owner);
    while (const auto key = flight.tree.eviction_candidate(part)) {
      CHECK(key->level > 0);
      CHECK_FALSE(kept.contains(*key));
      for (const geo::TileKey& earlier : gone) CHECK_FALSE((earlier != *key && geo::contains(earlier, *key)));
      REQUIRE(gone.insert(*key).second);
      flight.tree.released(*key, part);
    }
    CHECK(gone.size() > 50);
  }
  // What the picture needs is still there.
  CHECK(flight.tree.select(random_camera(planet.ellipsoid, random), settings, flight.now).draw.size() > 0);
}

TEST_CASE("eviction_candidate: tiles of a cut that was tried and did not fit may be dropped") {
  const EvenPlanet planet;
  Flight flight(planet);
  const view::Camera camera = camera_at(planet.ellipsoid, 20, 50, 30000, 10, -10);
  SelectionSettings settings;
  settings.sse_px = 0.1;
  const Selection* all = flight.finish(camera, settings);
  REQUIRE(all != nullptr);
  std::set<geo::TileKey> finer;
  for (const DrawTile& tile : all->draw) finer.insert(tile.key);
  settings.max_tiles = finer.size() / 2;
  const Selection* fewer = flight.finish(camera, settings);
  REQUIRE(fewer != nullptr);
  for (const DrawTile& tile : fewer->draw) finer.erase(tile.key);
  REQUIRE(finer.size() > 20);
  while (const auto key = flight.tree.eviction_candidate(Part::geometry)) {
    finer.erase(*key);
    flight.tree.released(*key, Part::geometry);
  }
  CHECK(finer.empty());
  CHECK(flight.tree.select(camera, settings, flight.now).stats.complete);
}

TEST_CASE("eviction_candidate: a child that arrived after its parents goes before them") {
  EvenPlanet planet;
  Flight flight(planet);
  const geo::TileKey key{3, 6, 20, 33};  // behind the body, where no frame looks
  for (const int level : {2, 4, 6, 5}) {
    flight.tree.arrived_geometry(geo::ancestor(key, level), planet.metrics_of(geo::ancestor(key, level)), false);
  }
  const view::Camera camera = camera_at(planet.ellipsoid, 0, 90, 1e6, 0, -90);
  CHECK_FALSE(flight.tree.eviction_candidate(Part::geometry).has_value());  // a frame may still want it
  for (int i = 0; i < 3; ++i) flight.tree.select(camera, SelectionSettings{}, flight.now);
  for (const int level : {6, 5, 4, 2}) {
    const auto candidate = flight.tree.eviction_candidate(Part::geometry);
    REQUIRE(candidate.has_value());
    CHECK(*candidate == geo::ancestor(key, level));
    flight.tree.released(*candidate, Part::geometry);
  }
  CHECK_FALSE(flight.tree.eviction_candidate(Part::geometry).has_value());
}

TEST_CASE("select: frozen keeps the cut, culling included") {
  EvenPlanet planet;
  Flight flight(planet);
  SelectionSettings settings;
  const Selection* before = flight.finish(camera_at(planet.ellipsoid, 10, 10, 1e5, 0, -90), settings);
  REQUIRE(before != nullptr);
  const std::string text = text_of(*before);
  settings.frozen = true;
  const Selection& after = flight.frame(camera_at(planet.ellipsoid, -40, 100, 1e4, 0, -20), settings);
  CHECK(text_of(after) == text);
  CHECK(after.requests.empty());
}

TEST_CASE("select: with transitions a new tile fades and morphs in over 300 ms, and children return to their parent") {
  EvenPlanet planet;
  Flight flight(planet);
  SelectionSettings settings;
  settings.transitions = true;
  const view::Camera far = camera_at(planet.ellipsoid, 20, 30, 4e6, 0, -90);
  const view::Camera near = camera_at(planet.ellipsoid, 20, 30, 2e6, 0, -90);
  REQUIRE(flight.finish(far, settings) != nullptr);
  const auto least = [](const Selection& selection) {
    float morph = 1;
    float fade = 1;
    for (const DrawTile& tile : selection.draw) {
      morph = std::min(morph, tile.morph);
      fade = std::min(fade, tile.fade);
      CHECK(geo::contains(tile.colour_before, tile.key));
      CHECK(geo::contains(tile.colour_owner, tile.key));
      if (tile.fade >= 1) CHECK(tile.colour_before == tile.colour_owner);
    }
    return std::min(morph, fade);
  };
  for (const view::Camera& camera : {near, far}) {
    int in_transition = 0;
    bool complete = false;
    float before = 0;
    for (int frame = 0; frame < 200 && !complete; ++frame) {
      const Selection& selection = flight.frame(camera, settings);
      const float now = least(selection);
      if (now < 1) {
        ++in_transition;
        CHECK_FALSE(selection.stats.complete);
      }
      before = now;
      complete = selection.stats.complete;
    }
    CHECK(complete);
    CHECK(before == 1);
    CHECK(in_transition >= 17);  // 300 ms are 19 frames
    CHECK(in_transition < 80);
  }
  // Without transitions the same picture.
  const std::string faded = text_of(flight.frame(far, settings));
  settings.transitions = false;
  CHECK(text_of(flight.frame(far, settings)) == faded);
}

TEST_CASE("select: the other metrics follow their formulas and end where the data end") {
  EvenPlanet planet;
  for (const LodMetric metric : {LodMetric::distance, LodMetric::solid_angle}) {
    SelectionSettings settings;
    settings.metric = metric;
    const view::Camera camera = camera_at(planet.ellipsoid, 20, 30, 50000, 0, -50);
    Flight flight(planet);
    const Selection* selection = flight.finish(camera, settings);
    REQUIRE(selection != nullptr);
    CHECK(selection->draw.size() > 20);
    const double texel_angle = 248 * camera.pixel_angle();
    for (const DrawTile& tile : selection->draw) {
      const TileShape shape = tile_shape(planet.ellipsoid, tile.key);
      if (tile.error_px <= 1.0 / 16) continue;  // nothing to gain
      if (metric == LodMetric::distance) CHECK(tile.distance * texel_angle >= shape.size);
      const double cap = shape.size * shape.size / (tile.distance * tile.distance);
      if (metric == LodMetric::solid_angle) CHECK((cap < texel_angle * texel_angle || tile.error_px < 1));
    }
  }
}

TEST_CASE("set_facts: what is resident stays and new facts count at once") {
  EvenPlanet planet;
  Flight flight(planet);
  const view::Camera camera = camera_at(planet.ellipsoid, 20, 30, 300000, 0, -90);
  const Selection* rough = flight.finish(camera, SelectionSettings{});
  REQUIRE(rough != nullptr);
  const int before = rough->stats.tiles_drawn;
  auto smooth = std::make_shared<EvenPlanet>(planet);
  smooth->colour_level = 3;
  flight.tree.set_facts(smooth);
  const Selection& after = flight.frame(camera, SelectionSettings{});
  for (const DrawTile& tile : after.draw) CHECK(tile.colour_owner.level <= 3);
  CHECK(after.draw.size() <= static_cast<std::size_t>(before));
}

TEST_CASE("foresee: what it asks for completes the later view, and the view of now stays as it is") {
  const EvenPlanet planet;
  const SelectionSettings settings;
  const view::Camera here = camera_at(planet.ellipsoid, 46, 8, 3e5, 30, -40), there = camera_at(planet.ellipsoid, 47, 8.5, 2.5e5, 30, -40);
  Flight plain(planet), foreseeing(planet);
  REQUIRE(plain.finish(here, settings) != nullptr);
  REQUIRE(foreseeing.finish(here, settings) != nullptr);
  // Nothing of it is there yet.
  const std::size_t wanted_there = [&] {
    Flight other(planet);
    REQUIRE(other.finish(here, settings) != nullptr);
    return other.frame(there, settings).requests.size();
  }();
  REQUIRE(wanted_there > 0);

  for (int i = 0; i < 40; ++i) {
    const auto requests = foreseeing.tree.foresee(there, settings, foreseeing.now);
    Selection ahead;
    ahead.requests.assign(requests.begin(), requests.end());
    foreseeing.loader.work(ahead, foreseeing.now, 1000, 1000);
    CHECK(text_of(foreseeing.frame(here, settings)) == text_of(plain.frame(here, settings)));
    // What this view draws is not to be dropped, whatever was foreseen.
    for (const Part part : {Part::geometry, Part::colour}) {
      const auto dropped = foreseeing.tree.eviction_candidate(part);
      if (!dropped) continue;
      for (const DrawTile& tile : foreseeing.frame(here, settings).draw) CHECK(tile.key != *dropped);
    }
  }
  const Selection& arrived = foreseeing.frame(there, settings);
  CHECK(arrived.stats.tiles_waiting == 0);
  CHECK(arrived.stats.complete);
}
