// Patches, drawn as a renderer draws them, against the source looked up directly.
#include "surface/image_patches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "source/gdal/gdal_source.h"
#include "surface/control_grid.h"
#include "surface/made_world.h"
#include "surface/tile_grid.h"

using namespace tellurion;
using namespace tellurion::surface;
using namespace tellurion::surface::testing;

namespace {

/// A surface of colour layers and a model of it.
struct Pictures {
  std::shared_ptr<SurfaceDescription> description = std::make_shared<SurfaceDescription>();
  cache::BlockCache blocks{std::size_t{128} << 20};
  std::optional<ColourModel> model;

  explicit Pictures(std::vector<Layer> colours) {
    description->ellipsoid = geo::kWgs84;
    description->colours = std::move(colours);
    model.emplace(std::move(ColourModel::open(description, blocks)).value());
  }
  TileImagery of(const geo::TileKey& key) { return std::move(build_imagery(*model, key)).value(); }
};

/// Bilinear colour of an image at texture coordinates, clamped at its edges.
glm::dvec4 sampled(const raster::Image& image, glm::dvec2 at) {
  const glm::dvec2 p = at * glm::dvec2(image.width, image.height) - 0.5;
  const glm::dvec2 corner = glm::floor(p), share = p - corner;
  glm::dvec4 sum(0);
  for (int i = 0; i < 4; ++i) {
    const int x = std::clamp(static_cast<int>(corner.x) + (i & 1), 0, image.width - 1);
    const int y = std::clamp(static_cast<int>(corner.y) + (i >> 1), 0, image.height - 1);
    const auto c = image.at(x, y);
    sum += ((i & 1) ? share.x : 1 - share.x) * ((i >> 1) ? share.y : 1 - share.y) * glm::dvec4(c[0], c[1], c[2], c[3]);
  }
  return sum;
}

/// Where tile coordinates lie in a patch's image; nothing outside of the patch.
std::optional<glm::dvec2> image_place(const ImagePatch& patch, glm::dvec2 st) {
  const glm::dvec2 at = (st - glm::dvec2(patch.lower)) / glm::dvec2(patch.upper - patch.lower) * glm::dvec2(patch.columns, patch.rows);
  if (at.x < 0 || at.y < 0 || at.x > patch.columns || at.y > patch.rows) return std::nullopt;
  const int column = std::min(static_cast<int>(at.x), patch.columns - 1), row = std::min(static_cast<int>(at.y), patch.rows - 1);
  const glm::dvec2 share = at - glm::dvec2(column, row);
  const auto point = [&](int x, int y) { return glm::dvec2(patch.image_points[static_cast<std::size_t>(y * (patch.columns + 1) + x)]); };
  const glm::dvec2 upper = glm::mix(point(column, row), point(column + 1, row), share.x);
  const glm::dvec2 lower = glm::mix(point(column, row + 1), point(column + 1, row + 1), share.x);
  return glm::mix(upper, lower, share.y);
}

/// What a patch draws at tile coordinates; nothing outside of it.
std::optional<glm::dvec4> drawn(const ImagePatch& patch, glm::dvec2 st) {
  const auto place = image_place(patch, st);
  if (!place) return std::nullopt;
  const double texel = 1.0 / (kColourSlotSide - 2 * kColourGutter);
  glm::dvec2 step(0);
  for (const glm::dvec2 way : {glm::dvec2(texel, 0), glm::dvec2(0, texel)}) {
    auto next = image_place(patch, st + way);
    if (!next) next = image_place(patch, st - way);
    if (next) step += (*next - *place) * (*next - *place);
  }
  const bool is_soft = patch.feather.x > 0.0f;
  const glm::dvec2 beyond = glm::max(glm::dvec2(patch.data_lower) - *place, *place - glm::dvec2(patch.data_upper)) /
                            glm::max(glm::max(glm::sqrt(step), glm::dvec2(is_soft ? patch.feather : patch.data_pixel)), 1e-12);
  return std::clamp((is_soft ? 0.0 : 1.0) - std::max(beyond.x, beyond.y), 0.0, 1.0) * sampled(patch.image, *place);
}

/// A slot after all patches, each over the ones before.
glm::dvec4 composed(const TileImagery& imagery, glm::dvec2 st) {
  glm::dvec4 slot(0);
  for (const ImagePatch& patch : imagery.patches) {
    if (const auto colour = drawn(patch, st)) slot = *colour * static_cast<double>(patch.opacity) + slot * (1 - static_cast<double>(patch.opacity) * colour->w / 255);
  }
  return slot;
}

/// Colours that are smooth over the sphere, poles and antimeridian included: the normal itself.
glm::dvec4 normal_colour(const glm::dvec3& n) { return {127.5 + 120 * n.x, 127.5 + 120 * n.y, 127.5 + 120 * n.z, 255}; }

MadeRaster normals_picture(int width, double west = -180, double east = 180) {
  MadeRaster made;
  made.width = width, made.height = width / 2;
  made.west = west, made.east = east;
  made.colour = [width, west](int x, int y) {
    const glm::dvec3 n = geo::normal_at(at(90 - (y + 0.5) * 360.0 / width, west + (x + 0.5) * 360.0 / width)).xyz;
    const glm::dvec4 c = glm::round(normal_colour(n));
    return std::array<std::uint8_t, 4>{static_cast<std::uint8_t>(c.x), static_cast<std::uint8_t>(c.y), static_cast<std::uint8_t>(c.z), 255};
  };
  return made;
}

glm::dvec2 slot_st(double x, double y) { return (glm::dvec2(x, y) - static_cast<double>(kColourGutter)) / (256.0 - 2 * kColourGutter); }

}  // namespace

TEST_CASE("map_slot: places between control points err by less than a third of a texel, all over the planet") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  const std::string shared = TELLURION_SHARED_DATA_DIR;
  std::vector<std::unique_ptr<source::RasterSource>> sources;
  sources.push_back(std::make_unique<MadeSource>(normals_picture(8192)));
  sources.push_back(std::make_unique<MadeSource>(normals_picture(4096, 0, 360)));
  for (const char* file : {"/earth/elevation/arctic_polar_stereographic.tif", "/earth/regional/mosaic_cog1.tif"}) {
    if (!std::filesystem::exists(shared + file)) continue;
    auto opened = source::open_gdal({.path = shared + file}, geo::kWgs84);
    REQUIRE(opened);
    sources.push_back(std::move(*opened));
  }
  std::uniform_real_distribution<double> share(0, 1);
  for (const auto& source : sources) {
    const source::RasterDescription& about = source->description();
    CAPTURE(about.name);
    const auto reader = std::move(source->open_reader()).value();
    int compared = 0;
    for (int i = 0; i < 150; ++i) {
      const int level = i % 10;
      geo::TileKey key{static_cast<std::uint8_t>(random() % 6), static_cast<std::uint8_t>(level), 0, 0};
      key.x = static_cast<std::uint32_t>(random()) & ((1u << level) - 1);
      key.y = static_cast<std::uint32_t>(random()) & ((1u << level) - 1);
      if (i % 4 == 0) {  // where the raster is
        const double lat = about.bounds.south.value + share(random) * (about.bounds.north - about.bounds.south).value;
        const double lon = about.bounds.west.value + share(random) * (about.bounds.east - about.bounds.west).value;
        key = geo::tile_at(geo::normal_at({Radians(lat), Radians(lon)}), level);
      }
      if (i % 4 == 1) key = geo::tile_at({{1e-9, 1e-9, i % 8 == 1 ? 1.0 : -1.0}}, level);
      CAPTURE(geo::to_string(key));
      const SlotMapping mapping = map_slot(geo::kWgs84, key, about, *reader);
      for (int j = 0; j < 400; ++j) {
        const glm::dvec2 st = slot_st(share(random) * 256, share(random) * 256);
        const geo::Vector<geo::Ecef> normal = geo::tile_normal(key, st);
        const geo::LatLon place = geo::place_of_normal(normal);
        glm::dvec2 pixel;
        reader->to_pixels({&place, 1}, {&pixel, 1});
        const bool inside = pixel.x >= 0 && pixel.y >= 0 && pixel.x <= about.levels[0].width && pixel.y <= about.levels[0].height;
        int grids = 0;
        for (const ControlGrid& grid : mapping.grids) {
          const glm::dvec2 in_grid = (st - grid.lower) / (grid.upper - grid.lower) * glm::dvec2(grid.columns, grid.rows);
          if (in_grid.x < 0 || in_grid.y < 0 || in_grid.x >= grid.columns || in_grid.y >= grid.rows) continue;
          ++grids;
          if (!grid.follows || !inside) continue;
          const int column = static_cast<int>(in_grid.x), row = static_cast<int>(in_grid.y);
          const glm::dvec2 f = in_grid - glm::dvec2(column, row);
          const auto point = [&](int x, int y) { return grid.pixels[static_cast<std::size_t>(y * (grid.columns + 1) + x)]; };
          glm::dvec2 mapped = glm::mix(glm::mix(point(column, row), point(column + 1, row), f.x),
                                       glm::mix(point(column, row + 1), point(column + 1, row + 1), f.x), f.y);
          if (about.wraps) mapped.x -= about.levels[0].width * std::floor(mapped.x / about.levels[0].width);
          geo::LatLon there;
          reader->to_places({&mapped, 1}, {&there, 1});
          const double off = glm::distance(geo::normal_at(there).xyz, normal.xyz) * geo::kWgs84.a();
          // Texels are smallest, 0.7 of the nominal size, at the corners of a face.
          REQUIRE(off < nominal_colour_texel(geo::kWgs84, level) / 3);
          ++compared;
        }
        REQUIRE(grids <= 1);
        if (inside) REQUIRE(grids == 1);
      }
    }
    CHECK(compared > 1000);
  }
}

TEST_CASE("build_imagery: the patches show the source everywhere, poles, antimeridian and gutters included") {
  const auto seed = fresh_seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(0, 256);
  for (const double west : {-180.0, 0.0}) {
    Pictures pictures({layer_of(normals_picture(2048, west, west + 360), 1)});
    std::vector<geo::TileKey> keys;
    for (std::uint8_t face = 0; face < 6; ++face) keys.push_back({face, 0, 0, 0});
    for (int level = 1; level <= 6; ++level) {
      for (const double z : {1.0, -1.0}) keys.push_back(geo::tile_at({{1e-9, 1e-9, z}}, level));
      keys.push_back(geo::tile_at(geo::normal_at(at(20, 179.999)), level));
      keys.push_back(geo::tile_at(geo::normal_at(at(80 * std::sin(level), 50 * level)), level));
    }
    for (const geo::TileKey& key : keys) {
      CAPTURE(geo::to_string(key));
      const TileImagery imagery = pictures.of(key);
      CHECK(imagery.patches.size() <= (key.level == 0 ? 40u : 12u));
      double worst = 0;
      for (int i = 0; i < 3000; ++i) {
        const glm::dvec2 st = slot_st(share(random), share(random));
        const glm::dvec4 expected = normal_colour(geo::tile_normal(key, st).xyz);
        worst = std::max(worst, glm::distance(composed(imagery, st), expected));
      }
      // A texel or pixel off: at most 1.5 times 120 per radian and texel; rounding.
      const double texel = std::max(geo::tile_angle(key.level).value / 248, 2 * kPi / 2048);
      CHECK(worst < 2.0 + 1.5 * 120 * texel);
      for (const ImagePatch& patch : imagery.patches) {
        CHECK(patch.opaque);
        CHECK(patch.image.width <= kLargestWindow);
        CHECK(patch.image.height <= kLargestWindow);
      }
    }
  }
}

TEST_CASE("build_imagery: windows have one to two pixels a texel on either axis where the source is fine enough") {
  Pictures pictures({layer_of(normals_picture(8192), 1)});
  for (const double latitude : {0.0, 30.0, 60.0, 75.0}) {
    CAPTURE(latitude);
    const geo::TileKey key = geo::tile_at(geo::normal_at(at(latitude, 20)), 3);
    const TileImagery imagery = pictures.of(key);
    REQUIRE(imagery.patches.size() == 1);
    const ImagePatch& patch = imagery.patches[0];
    const double texels = kColourSlotSide / 16.0;  // of a cell
    const glm::dvec2 size(patch.image.width, patch.image.height);
    std::vector<double> columns, rows;
    for (int y = 0; y < patch.rows; ++y) {
      for (int x = 0; x < patch.columns; ++x) {
        const auto point = [&](int i, int j) { return glm::dvec2(patch.image_points[static_cast<std::size_t>(j * (patch.columns + 1) + i)]) * size; };
        const glm::dvec2 ds = (point(x + 1, y) - point(x, y)) / texels, dt = (point(x, y + 1) - point(x, y)) / texels;
        columns.push_back(std::hypot(ds.x, dt.x)), rows.push_back(std::hypot(ds.y, dt.y));
      }
    }
    for (std::vector<double>* values : {&columns, &rows}) {
      std::sort(values->begin(), values->end());
      CHECK((*values)[values->size() / 2] >= 0.99);
      CHECK((*values)[values->size() / 2] <= 2.01);
    }
  }
}

TEST_CASE("build_imagery: a raster far smaller than a texel takes no more room than itself") {
  MadeRaster spot;
  spot.width = spot.height = 400;
  spot.west = 8.5, spot.east = 8.5001, spot.south = 47.3, spot.north = 47.3001;  // 11 m
  spot.colour = [](int, int) { return std::array<std::uint8_t, 4>{200, 100, 50, 255}; };
  Pictures pictures({layer_of(spot, 1)});
  for (int level = 0; level <= 20; ++level) {
    const geo::TileKey key = geo::tile_at(geo::normal_at(at(47.30005, 8.50005)), level);
    CAPTURE(geo::to_string(key));
    for (const ImagePatch& patch : pictures.of(key).patches) CHECK(patch.image.rgba.size() <= 4u * 1024 * 1024);
  }
}

TEST_CASE("build_imagery: beyond a raster's border nothing is drawn, within it all, voids are seen through") {
  MadeRaster region;
  region.width = region.height = 500;
  region.west = 10, region.east = 20, region.south = 40, region.north = 50;
  region.colour = [](int x, int y) {
    return x > 240 && x < 260 && y > 240 && y < 260 ? std::array<std::uint8_t, 4>{0, 0, 0, 0} : std::array<std::uint8_t, 4>{200, 100, 50, 255};
  };
  Pictures pictures({layer_of(region, 1)});
  CHECK(pictures.of(geo::tile_at(geo::normal_at(at(-45, 15)), 6)).patches.empty());
  const auto seed = fresh_seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(0, 256);
  int inside = 0, outside = 0, in_void = 0;
  for (int level = 0; level <= 8; ++level) {
    for (const auto& [lat, lon] : {std::pair(45.0, 15.0), std::pair(50.0, 14.0), std::pair(41.0, 20.0), std::pair(40.0, 10.0)}) {
      const geo::TileKey key = geo::tile_at(geo::normal_at(at(lat, lon)), level);
      CAPTURE(geo::to_string(key));
      const TileImagery imagery = pictures.of(key);
      // Bilinear filtering blurs by a pixel of the source or of the window, whichever is larger.
      const double blur = std::max(0.02, to_degrees(geo::tile_angle(level)).value / 248) * 4;
      const auto degrees_of = [&](glm::dvec2 st) {
        const geo::LatLon place = geo::place_of_normal(geo::tile_normal(key, st));
        return glm::dvec2(to_degrees(place.latitude).value, to_degrees(place.longitude).value);
      };
      for (int i = 0; i < 2000; ++i) {
        const glm::dvec2 st = slot_st(share(random), share(random)), here = degrees_of(st);
        const double latitude = here.x, longitude = here.y;
        const double within = std::min({latitude - 40, 50 - latitude, longitude - 10, 20 - longitude});
        // A texel of the slot there, in degrees on the wider axis. Places are right to a third of it; beyond the border it fades over a pixel
        // of the source or a texel, and a texel's width varies by less than a tenth within that.
        const glm::dvec2 along_s = degrees_of(st + glm::dvec2(1.0 / 248, 0)) - here, along_t = degrees_of(st + glm::dvec2(0, 1.0 / 248)) - here;
        const double texel = 1.1 * std::max(std::hypot(along_s.x, along_t.x), std::hypot(along_s.y, along_t.y));
        const double from_void = std::max(std::abs(latitude - 45), std::abs(longitude - 15));
        const glm::dvec4 colour = composed(imagery, st);
        if (within < -(std::max(0.02, texel) + texel / 3)) {
          REQUIRE(colour == glm::dvec4(0));
          ++outside;
        } else if (within > texel / 3 && from_void > 0.2 + blur) {
          REQUIRE(glm::distance(colour, glm::dvec4(200, 100, 50, 255)) < 1.01);
          ++inside;
        } else if (from_void < 0.18 - blur) {
          REQUIRE(colour == glm::dvec4(0));
          ++in_void;
        }
      }
    }
  }
  CHECK(inside > 1000);
  CHECK(outside > 1000);
  CHECK(in_void > 300);
}

TEST_CASE("build_imagery: a feather fades a raster in from its border and from its voids, to nothing beyond") {
  MadeRaster region;
  region.width = region.height = 500;
  region.west = 10, region.east = 20, region.south = 40, region.north = 50;
  region.colour = [](int x, int y) {
    return x >= 200 && x < 300 && y >= 200 && y < 300 ? std::array<std::uint8_t, 4>{0, 0, 0, 0} : std::array<std::uint8_t, 4>{255, 255, 255, 255};
  };
  constexpr double kFeather = 40.0, kPixel = 0.02;  // pixels; degrees
  Layer layer = layer_of(region, 1);
  layer.feather = kFeather;
  Pictures pictures({layer});
  const auto seed = fresh_seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(0, 256);
  int ramp = 0, outside = 0, full = 0, corner = 0;
  for (int level = 5; level <= 9; ++level) {
    for (const auto& [lat, lon] : {std::pair(45.0, 15.0), std::pair(49.9, 14.0), std::pair(41.0, 19.9), std::pair(40.1, 10.1), std::pair(46.1, 13.9)}) {
      const geo::TileKey key = geo::tile_at(geo::normal_at(at(lat, lon)), level);
      CAPTURE(geo::to_string(key));
      const TileImagery imagery = pictures.of(key);
      for (int i = 0; i < 2000; ++i) {
        const glm::dvec2 st = slot_st(share(random), share(random));
        const geo::LatLon place = geo::place_of_normal(geo::tile_normal(key, st));
        const glm::dvec2 pixel = glm::dvec2(to_degrees(place.longitude).value - 10, 50 - to_degrees(place.latitude).value) / kPixel;
        const glm::dvec2 to_border = glm::min(pixel, 500.0 - pixel), to_void = glm::max(glm::max(200.0 - pixel, pixel - 300.0), 0.0);
        const double border = std::min(to_border.x, to_border.y);
        const double expected = std::clamp(std::min(border, glm::length(to_void)) / kFeather, 0.0, 1.0);
        // A third of a texel for the place, what bilinear filtering rounds off where a slope ends, half a pixel round a void's corner.
        const double texel = to_degrees(geo::tile_angle(key.level)).value / 248 / kPixel;
        const double off = std::max(texel, 1.0) / kFeather + 0.01;
        const double alpha = composed(imagery, st).w / 255;
        REQUIRE(std::abs(alpha - expected) < off);
        if (border < 0) REQUIRE(alpha <= texel / 3 / kFeather);
        outside += border < 0;
        full += expected == 1.0;
        ramp += expected > 0.1 && expected < 0.9;
        corner += expected > 0.1 && expected < 0.9 && to_border.x < kFeather && to_border.y < kFeather;
      }
      for (const ImagePatch& patch : imagery.patches) {
        if (patch.opaque) CHECK(std::abs(lat - 45.0) < 3.0);  // not those that touch a border
      }
    }
  }
  CHECK(ramp > 1000);
  CHECK(outside > 1000);
  CHECK(full > 1000);
  CHECK(corner > 100);
}

TEST_CASE("build_imagery: where two layers end on one line nothing shows between them") {
  MadeRaster west, east;
  west.width = west.height = east.width = east.height = 500;
  west.west = 10, west.east = east.west = 15, east.east = 20;
  west.south = east.south = 42.5, west.north = east.north = 47.5;
  west.colour = east.colour = [](int, int) { return std::array<std::uint8_t, 4>{200, 100, 50, 255}; };
  Pictures pictures({layer_of(west, 1), layer_of(east, 2)});
  for (int level = 6; level <= 10; ++level) {
    const geo::TileKey key = geo::tile_at(geo::normal_at(at(45.1, 15.0)), level);
    CAPTURE(geo::to_string(key));
    const TileImagery imagery = pictures.of(key);
    REQUIRE(imagery.patches.size() == 2);
    int on_the_line = 0;
    for (int i = 0; i < 256; ++i) {
      for (int j = 0; j < 256; ++j) {
        const glm::dvec2 st = slot_st(i + 0.5, j + 0.5);
        const geo::LatLon place = geo::place_of_normal(geo::tile_normal(key, st));
        const double latitude = to_degrees(place.latitude).value, longitude = to_degrees(place.longitude).value;
        if (latitude < 43.5 || latitude > 46.5 || std::abs(longitude - 15) > 0.02) continue;
        REQUIRE(glm::distance(composed(imagery, st), glm::dvec4(200, 100, 50, 255)) < 1.01);
        ++on_the_line;
      }
    }
    CHECK(on_the_line > 100);
  }
}

TEST_CASE("build_imagery: layers keep their order and settings; one that hides all below leaves them out") {
  MadeRaster white = normals_picture(512), half = normals_picture(512);
  half.colour = [](int, int) { return std::array<std::uint8_t, 4>{0, 64, 0, 128}; };
  Layer below = layer_of(white, 1), middle = layer_of(half, 2), top = layer_of(white, 3);
  middle.gamma = 2.0f, middle.multiplier = 0.5f;
  const geo::TileKey key{0, 2, 1, 1};
  const TileImagery both = Pictures({below, middle}).of(key);
  REQUIRE(both.patches.size() == 2);
  CHECK(both.patches[0].opaque);
  CHECK(!both.patches[1].opaque);
  CHECK(both.patches[1].gamma == 2.0f);
  CHECK(both.patches[1].multiplier == 0.5f);
  CHECK(Pictures({below, middle, top}).of(key).patches.size() == 1);
  top.opacity = 0.5f;
  const TileImagery all = Pictures({below, middle, top}).of(key);
  REQUIRE(all.patches.size() == 3);
  CHECK(!all.patches[2].opaque);
  CHECK(all.patches[2].opacity == 0.5f);
  top.enabled = false;
  CHECK(Pictures({below, middle, top}).of(key).patches.size() == 2);
}

TEST_CASE("build_imagery: layers of night and water are effects, and hide only those of their own use") {
  MadeRaster white = normals_picture(512);
  Layer ground = layer_of(white, 1), night = layer_of(white, 2), water = layer_of(white, 3), more_night = layer_of(white, 4);
  night.use = more_night.use = ImageUse::night;
  water.use = ImageUse::water;
  const TileImagery imagery = Pictures({ground, night, water, more_night}).of({0, 2, 1, 1});
  REQUIRE(imagery.patches.size() == 1);
  CHECK(imagery.patches[0].use == ImageUse::colour);
  REQUIRE(imagery.effects.size() == 2);
  CHECK(imagery.effects[0].use == ImageUse::water);
  CHECK(imagery.effects[1].use == ImageUse::night);
  CHECK(imagery.bytes() > 2 * imagery.patches[0].image.bytes());
}

TEST_CASE("build_imagery: grayscale hides no colours, what lies over it hides both, and overlays are a list of their own") {
  MadeRaster white = normals_picture(512), clear = normals_picture(512);
  clear.colour = [](int, int) { return std::array<std::uint8_t, 4>{}; };
  Layer ground = layer_of(white, 1), relief = layer_of(white, 2), more_relief = layer_of(white, 3), sign = layer_of(white, 4);
  const Layer top = layer_of(white, 5);
  relief.use = more_relief.use = ImageUse::grayscale;
  sign.use = ImageUse::overlay;
  const TileImagery shown = Pictures({ground, relief, more_relief, sign}).of({0, 2, 1, 1});
  REQUIRE(shown.patches.size() == 2);
  CHECK(shown.patches[0].use == ImageUse::colour);
  CHECK(shown.patches[1].use == ImageUse::grayscale);
  CHECK(shown.overlays.size() == 1);
  CHECK(shown.effects.empty());
  CHECK(shown.bytes() > 3 * shown.patches[0].image.bytes());
  CHECK(Pictures({ground, relief, top}).of({0, 2, 1, 1}).patches.size() == 1);
  Layer nothing = layer_of(clear, 6);
  nothing.use = ImageUse::overlay;
  CHECK(Pictures({ground, nothing}).of({0, 2, 1, 1}).overlays.empty());
}

TEST_CASE("build_imagery: a layer that cannot be read is named, and the others are there, those below it too") {
  MadeRaster white = normals_picture(512), broken = normals_picture(512);
  broken.broken = true;
  const TileImagery imagery = Pictures({layer_of(white, 1), layer_of(broken, 2)}).of({0, 2, 1, 1});
  CHECK(imagery.patches.size() == 1);
  REQUIRE(imagery.missing.size() == 1);
  CHECK(imagery.missing[0].source_id == 2);
  CHECK(imagery.missing[0].error.code == ErrorCode::unavailable);
}

TEST_CASE("ColourModel: rasters that the model before has open stay open") {
  MadeRaster raster;
  raster.colour = [](int x, int y) { return std::array<std::uint8_t, 4>{static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), 50, 255}; };
  Pictures before({layer_of(raster, 1), layer_of(raster, 2)});
  const auto readers = [&](std::size_t layer) { return dynamic_cast<const MadeSource&>(*before.description->colours[layer].source).readers_opened; };
  const geo::TileKey key{2, 1, 0, 1};
  auto now = std::make_shared<SurfaceDescription>(*before.description);
  now->colours[0].opacity = 0.5f;
  now->colours[1].source_id = 3;  // its content is another
  ColourModel taken = ColourModel::open(now, before.blocks, &*before.model).value();
  CHECK(readers(0) == 1);
  CHECK(readers(1) == 2);
  ColourModel fresh = ColourModel::open(now, before.blocks).value();
  const TileImagery a = build_imagery(taken, key).value(), b = build_imagery(fresh, key).value();
  REQUIRE(a.patches.size() == b.patches.size());
  for (std::size_t i = 0; i < a.patches.size(); ++i) CHECK(a.patches[i].image.rgba == b.patches[i].image.rgba);
}
