#include "surface/error_table.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "surface/error_scan.h"
#include "surface/made_world.h"
#include "surface/rtin.h"
#include "surface/surface_facts_made.h"
#include "surface/tile_grid.h"

using namespace tellurion;
using namespace tellurion::surface;
using namespace tellurion::surface::testing;

namespace {

MadeRaster rough_globe(std::uint64_t seed) {
  MadeRaster raster;
  raster.width = 2160, raster.height = 1080;  // 18.5 km: the table ends with level 3
  raster.metres = [seed](int x, int y) { return noise(x, y, seed, 0, 500) + noise(x / 7, y / 7, seed, -4000, 4000); };
  return raster;
}

MadeRaster rough_region(std::uint64_t seed) {
  MadeRaster raster;
  raster.width = raster.height = 240;  // 0.9 km over 2 degrees
  raster.west = 7, raster.east = 9, raster.south = 45, raster.north = 47;
  raster.metres = [seed](int x, int y) {
    if (noise(x / 5, y / 5, seed + 3, 0, 1) < 0.05f) return NAN;
    return noise(x, y, seed, 0, 200) + noise(x / 9, y / 9, seed + 1, 0, 2500);
  };
  return raster;
}

std::vector<SubtreeScan> scans_of(MadeWorld& world, bool backwards = false) {
  std::vector<geo::TileKey> jobs = scan_jobs();
  if (backwards) std::reverse(jobs.begin(), jobs.end());
  std::vector<SubtreeScan> scans;
  for (const geo::TileKey& job : jobs) scans.push_back(std::move(scan_subtree(*world.model, job)).value());
  if (backwards) std::reverse(scans.begin(), scans.end());
  return scans;
}

std::filesystem::path scratch(const std::string& name) {
  return std::filesystem::temp_directory_path() / ("tellurion_error_table_" + std::to_string(std::random_device{}()) + name);
}

struct Removed {
  std::filesystem::path path;
  ~Removed() { std::filesystem::remove_all(path); }
};

/// Holds the table of a world against its surface at random places of tiles; the level of the deepest that it knows.
int check_table(MadeWorld& world, const std::vector<geo::TileKey>& keys, std::mt19937_64& random) {
  const auto table = std::make_shared<ErrorTable>(merge_scans(scans_of(world)));
  const auto facts = make_facts(world.description, std::make_shared<KnownErrors>(KnownErrors{table}));
  std::vector<double> ratios;
  int deepest = 0;
  for (const geo::TileKey& key : keys) {
    const TileFacts known = facts->facts_of(key);
    if (!known.height_error) continue;
    CAPTURE(geo::to_string(key));
    deepest = std::max<int>(deepest, key.level);
    // The tile's own grid against the surface at random places.
    const auto normals = grid_normals({key, kGridSide});
    std::vector<double> grid(normals.size());
    REQUIRE(world.model->heights(normals, nominal_grid_spacing(geo::kWgs84, key.level), grid));
    std::uniform_real_distribution<double> share(0, 1);
    std::vector<geo::Vector<geo::Ecef>> places;
    std::vector<glm::dvec2> st;
    for (int i = 0; i < 60000; ++i) {
      st.push_back({share(random), share(random)});
      places.push_back(geo::tile_normal(key, st.back()));
    }
    std::vector<double> truth(places.size());
    REQUIRE(world.model->heights(places, 0.0, truth));
    double largest = 0;
    for (std::size_t i = 0; i < st.size(); ++i) {
      largest = std::max(largest, std::abs(truth[i] - interpolate_in_triangles(grid, kGridSide, st[i].x * (kGridSide - 1), st[i].y * (kGridSide - 1))));
      REQUIRE(truth[i] >= static_cast<double>(known.min_height));
      REQUIRE(truth[i] <= static_cast<double>(known.max_height));
    }
    CHECK(largest <= static_cast<double>(known.height_error->bound));
    ratios.push_back(static_cast<double>(known.height_error->bound) / std::max(largest, 1e-3));
    if (key.level > 0) {
      const TileFacts above = facts->facts_of(geo::parent(key));
      CHECK(above.height_error->bound >= known.height_error->bound);
      CHECK(above.height_error->common >= known.height_error->common);
      CHECK(above.min_height <= known.min_height);
      CHECK(above.max_height >= known.max_height);
    }
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
  CHECK(ratios[ratios.size() / 2] < 2);
  return deepest;
}

}  // namespace

TEST_CASE("scan_subtree: the table bounds the truth of every tile, is monotone, and is not far too large") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  MadeWorld world({layer_of(rough_globe(seed), 1), layer_of(rough_region(seed), 2)});
  std::mt19937_64 random(seed);
  std::vector<geo::TileKey> keys;
  for (int level = 0; level <= 3; ++level) {
    for (int i = 0; i < 12; ++i) {
      geo::TileKey key{static_cast<std::uint8_t>(random() % 6), static_cast<std::uint8_t>(level), 0, 0};
      key.x = static_cast<std::uint32_t>(random()) & ((1u << level) - 1);
      key.y = static_cast<std::uint32_t>(random()) & ((1u << level) - 1);
      keys.push_back(key);
    }
  }
  std::uniform_real_distribution<double> latitude(44.9, 47.1), longitude(6.9, 9.1);
  for (int i = 0; i < 30; ++i) {
    const geo::TileKey deep = geo::tile_at(geo::normal_at(at(latitude(random), longitude(random))), 12);
    for (int level = 4; level <= 8; ++level) keys.push_back(geo::ancestor(deep, level));
  }
  CHECK(check_table(world, keys, random) >= 6);
}

TEST_CASE("scan_subtree: the same of a raster alone, whose tiles are covered wholly but at its borders") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  MadeRaster region = rough_region(seed);
  region.width = region.height = 400;
  region.west = 6, region.east = 10, region.south = 44, region.north = 48;
  region.metres = [seed](int x, int y) { return noise(x, y, seed, 0, 200) + noise(x / 9, y / 9, seed + 1, 0, 2500); };
  MadeWorld world({layer_of(region, 1)});
  const ErrorTable table = merge_scans(scans_of(world));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> latitude(43.9, 48.1), longitude(5.9, 10.1);
  std::vector<geo::TileKey> keys;
  int whole = 0, partly = 0;
  for (int i = 0; i < 30; ++i) {
    const geo::TileKey deep = geo::tile_at(geo::normal_at(at(latitude(random), longitude(random))), 12);
    for (int level = 3; level <= 8; ++level) keys.push_back(geo::ancestor(deep, level));
    ++(table.find(deep).record.whole != 0 ? whole : partly);
  }
  CHECK(whole > 3);
  CHECK(partly > 3);
  CHECK(check_table(world, keys, random) >= 6);
}

TEST_CASE("merge_scans: the table is the same whichever worker does what, in whatever order") {
  MadeWorld one({layer_of(rough_globe(5), 1)});
  MadeWorld other({layer_of(rough_globe(5), 1)});
  const ErrorTable forwards = merge_scans(scans_of(one)), backwards = merge_scans(scans_of(other, true));
  REQUIRE(forwards.tile_count() == backwards.tile_count());
  CHECK(forwards.tile_count() == 6 * (1 + 4 + 16));
  std::mt19937_64 random(1);
  for (int i = 0; i < 500; ++i) {
    const int level = static_cast<int>(random() % 6);
    const geo::TileKey key{static_cast<std::uint8_t>(random() % 6), static_cast<std::uint8_t>(level),
                           static_cast<std::uint32_t>(random()) & ((1u << level) - 1), static_cast<std::uint32_t>(random()) & ((1u << level) - 1)};
    CHECK(forwards.find(key).record == backwards.find(key).record);
    CHECK(forwards.find(key).own == (level <= 2));
  }
}

TEST_CASE("JobMerge: parts find what a job finds of all at once") {
  MadeWorld world({layer_of(rough_region(8), 1)});
  const geo::TileKey deep = geo::tile_at(geo::normal_at(at(46, 8)), 6);
  const geo::TileKey root = geo::ancestor(deep, 2);
  const auto whole = scan_subtree(*world.model, root);
  REQUIRE(whole);
  std::vector<geo::TileKey> parts{root};
  const auto split = [&](const geo::TileKey& key) {
    const auto at_key = std::find(parts.begin(), parts.end(), key);
    REQUIRE(at_key != parts.end());
    const auto place = at_key - parts.begin();
    parts.erase(at_key);
    for (int i = 0; i < 4; ++i) parts.insert(parts.begin() + place + i, geo::child(key, i));
  };
  for (int level = 2; level < 5; ++level) split(geo::ancestor(deep, level));
  JobMerge merge(root);
  for (const geo::TileKey& part : parts) merge.add(std::move(scan_part(*world.model, part)).value());
  const SubtreeScan merged = std::move(merge).finish();
  REQUIRE(merged.tree.size() == whole->tree.size());
  CHECK(merged.above == whole->above);
  const auto same = [&](const auto& self, std::size_t one, std::size_t other) -> void {
    CHECK(merged.tree[one].record == whole->tree[other].record);
    REQUIRE((merged.tree[one].children == 0) == (whole->tree[other].children == 0));
    for (std::size_t i = 0; merged.tree[one].children != 0 && i < 4; ++i) self(self, merged.tree[one].children + i, whole->tree[other].children + i);
  };
  same(same, 0, 0);
  CHECK(merged.tree[0].record.error.common > 100);
  CHECK(merged.tree[0].record.error.common < merged.tree[0].record.error.bound);
}

TEST_CASE("parts_of_job: no part is much larger than the others, together they are the job") {
  SurfaceDescription description;
  description.ellipsoid = geo::kWgs84;
  CHECK(parts_of_job(description, {0, 2, 0, 0}) == std::vector<geo::TileKey>{{0, 2, 0, 0}});
  MadeRaster large;
  large.width = 40000, large.height = 20000;
  description.heights = {layer_of(large, 1)};
  const auto parts = parts_of_job(description, {1, 2, 3, 0});
  CHECK(parts.size() == 4);
  for (const geo::TileKey& part : parts) CHECK(geo::parent(part) == geo::TileKey{1, 2, 3, 0});
}

TEST_CASE("make_facts: a large raster rests on its own table where nothing else shows, on assumptions elsewhere") {
  MadeRaster large = rough_region(9);
  large.width = large.height = 12000;
  const Layer base = layer_of(rough_globe(9), 1), region = layer_of(large, 2);
  REQUIRE(!is_scanned(region));
  const geo::TileKey deep = geo::tile_at(geo::normal_at(at(46, 8)), 9), sibling = geo::child(geo::parent(deep), (geo::child_index(deep) + 1) % 4);
  RecordTree tree(geo::kFaceCount);
  std::size_t node = deep.face;
  for (int level = 1; level <= deep.level; ++level) node = tree.add_children(node) + static_cast<std::size_t>(geo::child_index(geo::ancestor(deep, level)));
  tree[node].record = {100, 200, {3, 2}, 1};
  auto description = std::make_shared<SurfaceDescription>();
  description->ellipsoid = geo::kWgs84;
  description->heights = {base, region};
  CHECK(wants_prepared_table(*description, region));
  CHECK(!wants_prepared_table(*description, base));
  const auto errors = std::make_shared<KnownErrors>(KnownErrors{nullptr, {{region.source, ErrorTable(tree)}}});
  const auto own = [&](const geo::TileKey& key) {
    const TileFacts known = make_facts(description, errors)->facts_of(key);
    return !known.assumed && known.min_height == 100 && known.max_height == 200 && known.height_error == HeightError{3, 2};
  };
  CHECK(own(deep));
  CHECK(!make_facts(description, errors)->facts_of(geo::child(deep, 0)).assumed);
  CHECK(make_facts(description, errors)->facts_of(sibling).assumed);  // not known to be whole: the base shows
  CHECK(make_facts(description, nullptr)->facts_of(deep).assumed);
  description->heights[1].adds = true;
  CHECK(!own(deep));
  description->heights = {region, base};  // hidden
  CHECK(!own(deep));
  description->heights = {region};
  CHECK(own(deep));
  CHECK(!make_facts(description, errors)->facts_of(sibling).assumed);
  const std::string before = errors_revision(*description);
  description->heights[0].enabled = false;
  CHECK(errors_revision(*description) != before);
}

TEST_CASE("save, load: the same table comes back; anything wrong with the file is corrupt, never a crash") {
  MadeWorld world({layer_of(rough_globe(6), 1)});
  const ErrorTable table = merge_scans(scans_of(world));
  const Removed folder{scratch("")};
  const std::filesystem::path path = folder.path / "deep" / "table";
  REQUIRE(ErrorTable::load(path, "r").error().code == ErrorCode::not_found);
  REQUIRE(table.save(path, "r"));
  const auto loaded = ErrorTable::load(path, "r");
  REQUIRE(loaded);
  REQUIRE(loaded->tile_count() == table.tile_count());
  for (const geo::TileKey& key : scan_jobs()) CHECK(loaded->find(geo::child(key, 2)).record == table.find(geo::child(key, 2)).record);
  CHECK(ErrorTable::load(path, "other").error().code == ErrorCode::corrupt);
  CHECK(std::distance(std::filesystem::directory_iterator(path.parent_path()), {}) == 1);  // no part left lying

  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  const auto seed = fresh_seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 200; ++i) {
    std::string damaged = bytes;
    if (i % 2 == 0) {
      damaged[random() % damaged.size()] ^= static_cast<char>(1 + random() % 255);
    } else {
      damaged.resize(random() % damaged.size());
    }
    std::ofstream(path, std::ios::binary) << damaged;
    const auto result = ErrorTable::load(path, "r");
    REQUIRE(!result);
    REQUIRE(result.error().code == ErrorCode::corrupt);
  }
}

TEST_CASE("load: heights and errors that no scan finds are corrupt") {
  const Removed file{scratch("")};
  const auto loads = [&](const TileRecord& record) {
    RecordTree tree(geo::kFaceCount);
    tree[3].record = record;
    REQUIRE(ErrorTable(std::move(tree)).save(file.path, "r"));
    return ErrorTable::load(file.path, "r").has_value();
  };
  CHECK(loads({-5, 7, {3, 2}, 1}));
  CHECK_FALSE(loads({NAN, 7, {3, 2}, 0}));
  CHECK_FALSE(loads({-5, INFINITY, {3, 2}, 0}));
  CHECK_FALSE(loads({8, 7, {3, 2}, 0}));
  CHECK_FALSE(loads({-5, 7, {2, 3}, 0}));
  CHECK_FALSE(loads({-5, 7, {INFINITY, 2}, 0}));
  CHECK_FALSE(loads({-5, 7, {NAN, NAN}, 0}));
  CHECK_FALSE(loads({-5, 7, {3, -1}, 0}));
  CHECK_FALSE(loads({-5, 7, {3, 2}, 2}));
}

TEST_CASE("scan_subtree: gives up when asked to") {
  MadeWorld world({layer_of(rough_globe(7), 1)});
  std::stop_source stop;
  stop.request_stop();
  CHECK(scan_subtree(*world.model, scan_jobs()[0], stop.get_token()).error().code == ErrorCode::cancelled);
}

TEST_CASE("table_revision: changes with every scanned height layer and its kind") {
  SurfaceDescription description;
  description.ellipsoid = geo::kWgs84;
  description.heights = {layer_of(rough_globe(1), 1)};
  const std::string before = table_revision(description);
  CHECK(table_revision(description) == before);
  description.heights[0].adds = true;
  CHECK(table_revision(description) != before);
  description.heights[0].adds = false;
  description.ellipsoid = geo::kMoon;
  CHECK(table_revision(description) != before);
  description.ellipsoid = geo::kWgs84;
  MadeRaster changed = rough_globe(1);
  changed.revision = "2";
  description.heights = {layer_of(changed, 1)};
  CHECK(table_revision(description) != before);
}

TEST_CASE("make_facts: without a table, safe assumptions that shrink with the level and end where the data's samples do") {
  auto description = std::make_shared<SurfaceDescription>();
  description->ellipsoid = geo::kWgs84;
  description->heights = {layer_of(rough_region(1), 1)};
  const auto facts = make_facts(description, nullptr);
  const geo::TileKey deep = geo::tile_at(geo::normal_at(at(46, 8)), 20);
  float before = 1e9f;
  bool ended = false;
  for (int level = 0; level <= 20; ++level) {
    const TileFacts known = facts->facts_of(geo::ancestor(deep, level));
    CHECK(known.min_height <= -11000);
    CHECK(known.max_height >= 9000);
    if (known.height_error) {
      CHECK(!ended);
      CHECK(known.height_error->bound < before);
      before = known.height_error->bound;
    } else {
      ended = true;
      CHECK(nominal_grid_spacing(geo::kWgs84, level) <= 1.5 * description->heights[0].source->description().spacing.value);
    }
  }
  CHECK(ended);
  CHECK(facts->facts_of(geo::TileKey{2, 4, 1, 1}).height_error == HeightError{});  // where there is nothing
}

TEST_CASE("make_facts: imagery asks for slots down to where its pixels are two texels, and no further") {
  auto description = std::make_shared<SurfaceDescription>();
  description->ellipsoid = geo::kWgs84;
  MadeRaster picture;
  picture.width = 4096, picture.height = 2048;  // 9.8 km
  description->colours = {layer_of(picture, 1)};
  const auto facts = make_facts(description, nullptr);
  for (int level = 0; level < 8; ++level) {
    const TileFacts known = facts->facts_of({0, static_cast<std::uint8_t>(level), 0, 0});
    CHECK(known.own_colour == (nominal_colour_texel(geo::kWgs84, level) * 4 > 9790));
    CHECK(known.finer_colour_below == (nominal_colour_texel(geo::kWgs84, level) * 2 > 9790));
  }
}
