#include "raster/quantized_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "raster/made_mesh.h"

using namespace tellurion;
using namespace tellurion::raster;
using test::MadeMesh;

namespace {

constexpr int kMost = QuantizedMesh::kMost;

/// Two triangles over the whole tile.
MadeMesh square() {
  MadeMesh mesh;
  mesh.vertices = {{0, 0, 0}, {kMost, 0, kMost}, {0, kMost, 0}, {kMost, kMost, kMost}};
  mesh.triangles = {{0, 1, 2}, {2, 1, 3}};
  return mesh;
}

/// `cells` x `cells` squares of two triangles each; inner vertices are moved about, heights are anything.
MadeMesh crumpled(int cells, std::mt19937& random) {
  std::uniform_real_distribution<double> share(-0.2, 0.2);  // no triangle turns over
  std::uniform_int_distribution<int> height(0, kMost);
  MadeMesh mesh;
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      const double x = i == 0 || i == cells ? i : i + share(random);
      const double y = j == 0 || j == cells ? j : j + share(random);
      mesh.vertices.push_back({static_cast<int>(x / cells * kMost), static_cast<int>(y / cells * kMost), height(random)});
    }
  }
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const auto sw = static_cast<std::uint32_t>(j * (cells + 1) + i), nw = sw + static_cast<std::uint32_t>(cells) + 1;
      mesh.triangles.push_back({sw, sw + 1, nw});
      if ((i + j) % 2 == 0) mesh.triangles.push_back({nw, sw + 1, nw + 1});
      else mesh.triangles.push_back({nw, nw + 1, sw + 1});  // the other way round
    }
  }
  return test::in_order(mesh);
}

/// The height of the mesh at a place by trying all triangles, in floating point; nothing where there is none.
std::optional<double> looked_up(const QuantizedMesh& mesh, double u, double v) {
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    const MeshVertex &a = mesh.vertices[mesh.triangles[t]], &b = mesh.vertices[mesh.triangles[t + 1]], &c = mesh.vertices[mesh.triangles[t + 2]];
    const double det = (b.v - c.v) * (a.u - c.u) + (c.u - b.u) * (a.v - c.v);
    const double wa = ((b.v - c.v) * (u - c.u) + (c.u - b.u) * (v - c.v)) / det;
    const double wb = ((c.v - a.v) * (u - c.u) + (a.u - c.u) * (v - c.v)) / det;
    if (std::min({wa, wb, 1 - wa - wb}) >= -1e-9)
      return mesh.lowest + (wa * a.height + wb * b.height + (1 - wa - wb) * c.height) / kMost * (mesh.highest - mesh.lowest);
  }
  return std::nullopt;
}

void check_against_lookup(const QuantizedMesh& mesh, int side) {
  const auto grid = rasterise(mesh, side, even_rows(side));
  REQUIRE(grid);
  double worst = 0;
  int voids = 0;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const auto expected = looked_up(mesh, (i + 0.5) / side * kMost, (1 - (j + 0.5) / side) * kMost);
      REQUIRE(expected);
      if (std::isnan(grid->at(i, j))) ++voids;
      else worst = std::max(worst, std::abs(static_cast<double>(grid->at(i, j)) - *expected));
    }
  }
  CHECK(voids == 0);
  // Centres are rounded to 1/8192 of a step; floats add 0.5 mm at 8 km.
  CHECK(worst < 1e-3 + 1e-6 * (mesh.highest - mesh.lowest));
}

ErrorCode code_of(const std::string& bytes) {
  const auto mesh = decode_quantized_mesh(bytes);
  REQUIRE_FALSE(mesh);
  CHECK_FALSE(mesh.error().message.empty());
  return mesh.error().code;
}

std::optional<std::string> shared_tile(const std::string& name) {
  const std::string path = std::string(TELLURION_SHARED_DATA_DIR) + "/earth/tiles/quantized_mesh/" + name;
  if (!std::filesystem::exists(path)) {
    MESSAGE("skipped: no " << path);
    return std::nullopt;
  }
  std::ifstream stream(path, std::ios::binary);
  return std::string{std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

TEST_CASE("decode_quantized_mesh: gives back the vertices and triangles that were written") {
  std::mt19937 random(7);
  MadeMesh made = crumpled(5, random);
  made.lowest = -12.5f;
  made.highest = 8848.0f;
  const auto mesh = decode_quantized_mesh(test::encoded(made));
  REQUIRE(mesh);
  CHECK(mesh->lowest == -12.5);
  CHECK(mesh->highest == 8848.0);
  REQUIRE(mesh->vertices.size() == made.vertices.size());
  for (std::size_t i = 0; i < made.vertices.size(); ++i)
    CHECK(std::array<int, 3>{mesh->vertices[i].u, mesh->vertices[i].v, mesh->vertices[i].height} == made.vertices[i]);
  REQUIRE(mesh->triangles.size() == 3 * made.triangles.size());
  for (std::size_t i = 0; i < mesh->triangles.size(); ++i) CHECK(mesh->triangles[i] == made.triangles[i / 3][i % 3]);
}

TEST_CASE("decode_quantized_mesh: more than 65,536 vertices have indices of 32 bits") {
  std::mt19937 random(8);
  const MadeMesh made = crumpled(256, random);
  REQUIRE(made.vertices.size() == 257 * 257);
  const auto mesh = decode_quantized_mesh(test::encoded(made));
  REQUIRE(mesh);
  CHECK(mesh->vertices.size() == made.vertices.size());
  CHECK(mesh->triangles.back() == made.triangles.back().back());
  const auto grid = rasterise(*mesh, 300, even_rows(300));
  REQUIRE(grid);
  CHECK(std::none_of(grid->metres.begin(), grid->metres.end(), [](float metres) { return std::isnan(metres); }));
}

TEST_CASE("decode_quantized_mesh: extensions are passed over, known or not, and must be whole") {
  MadeMesh made = square();
  made.extensions = std::string("\x01\x08\0\0\0", 5) + "8 bytes." + std::string("\x63\0\0\0\0", 5);
  CHECK(decode_quantized_mesh(test::encoded(made)));
  made.extensions += std::string("\x02\xff\xff\xff\xff", 5) + "few";
  CHECK(code_of(test::encoded(made)) == ErrorCode::corrupt);
}

TEST_CASE("decode_quantized_mesh: what is cut off anywhere is corrupt") {
  const std::string good = test::encoded(square());
  for (std::size_t length = 0; length < good.size(); ++length) {
    CAPTURE(length);
    CHECK(code_of(good.substr(0, length)) == ErrorCode::corrupt);
  }
}

TEST_CASE("decode_quantized_mesh: vertices outside, indices of none, heights that are no numbers and numbers too large are refused") {
  MadeMesh outside = square();
  outside.vertices[2][0] = kMost + 1;  // after one at kMost: the step is small
  CHECK(code_of(test::encoded(outside)) == ErrorCode::corrupt);
  outside.vertices[2][0] = -1;
  CHECK(code_of(test::encoded(outside)) == ErrorCode::corrupt);

  MadeMesh no_vertex = square();
  no_vertex.triangles.push_back({4, 0, 1});
  CHECK(code_of(test::encoded(no_vertex)) == ErrorCode::corrupt);

  std::string bytes = test::encoded(square());
  const std::size_t first_index = 92 + 4 * 6 + 4;
  bytes[first_index] = 9;  // below vertex 0
  CHECK(code_of(bytes) == ErrorCode::corrupt);

  bytes = test::encoded(square());
  bytes[first_index + 12 + 4] = 4;  // the western edge's first vertex
  CHECK(code_of(bytes) == ErrorCode::corrupt);

  MadeMesh upside_down = square();
  upside_down.lowest = 1e5f;
  CHECK(code_of(test::encoded(upside_down)) == ErrorCode::corrupt);
  upside_down.lowest = std::nanf("");
  CHECK(code_of(test::encoded(upside_down)) == ErrorCode::corrupt);

  bytes = test::encoded(square());
  bytes[88 + 3] = '\x7f';  // two thousand million vertices
  CHECK(code_of(bytes) == ErrorCode::exhausted);
  bytes = test::encoded(square());
  bytes[first_index - 1] = '\x7f';  // as many triangles
  CHECK(code_of(bytes) == ErrorCode::exhausted);
}

TEST_CASE("rasterise: a plane comes out as a plane, west low and east high") {
  const auto mesh = decode_quantized_mesh(test::encoded(square()));
  REQUIRE(mesh);
  const auto grid = rasterise(*mesh, 8, even_rows(4));
  REQUIRE(grid);
  CHECK(grid->width == 8);
  CHECK(grid->height == 4);
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 8; ++i) CHECK(grid->at(i, j) == doctest::Approx((i + 0.5) / 8 * kMost).epsilon(1e-7));
  }
}

TEST_CASE("rasterise: row 0 is north, and rows may lie anywhere") {
  MadeMesh made = square();
  for (auto& vertex : made.vertices) vertex[2] = vertex[1];
  made.highest = 100;
  const auto mesh = decode_quantized_mesh(test::encoded(made));
  REQUIRE(mesh);
  const auto grid = rasterise(*mesh, 1, std::array{0.99, 0.5, 0.1, 0.0});
  REQUIRE(grid);
  CHECK(grid->at(0, 0) == doctest::Approx(99));
  CHECK(grid->at(0, 1) == doctest::Approx(50));
  CHECK(grid->at(0, 2) == doctest::Approx(10));
  CHECK(grid->at(0, 3) == doctest::Approx(0));
}

TEST_CASE("rasterise: places on the edge between two triangles are covered") {
  for (const bool other_diagonal : {false, true}) {
    MadeMesh made = square();
    if (other_diagonal) {
      made.triangles = {{0, 1, 3}, {0, 3, 2}};
      made = test::in_order(made);
    }
    const auto mesh = decode_quantized_mesh(test::encoded(made));
    REQUIRE(mesh);
    for (const int side : {1, 2, 3, 64, 65, 256}) {
      const auto grid = rasterise(*mesh, side, even_rows(side));
      REQUIRE(grid);
      CHECK(std::none_of(grid->metres.begin(), grid->metres.end(), [](float metres) { return std::isnan(metres); }));
    }
  }
}

TEST_CASE("rasterise: agrees with trying every triangle at every place") {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    const auto mesh = decode_quantized_mesh(test::encoded(crumpled(3 + static_cast<int>(seed), random)));
    REQUIRE(mesh);
    check_against_lookup(*mesh, 20 + 7 * static_cast<int>(seed));
  }
}

TEST_CASE("rasterise: what no triangle covers is void") {
  MadeMesh made = square();
  made.triangles.pop_back();
  made.vertices.pop_back();
  const auto mesh = decode_quantized_mesh(test::encoded(made));
  REQUIRE(mesh);
  const auto grid = rasterise(*mesh, 4, even_rows(4));
  REQUIRE(grid);
  CHECK(std::isnan(grid->at(3, 0)));
  CHECK_FALSE(std::isnan(grid->at(0, 3)));
  CHECK(std::count_if(grid->metres.begin(), grid->metres.end(), [](float metres) { return std::isnan(metres); }) == 6);
}

TEST_CASE("rasterise: many triangles over one another are refused before they take long") {
  MadeMesh made = square();
  for (int i = 0; i < 100'000; ++i) made.triangles.push_back({0, 1, 2});
  const auto mesh = decode_quantized_mesh(test::encoded(made));
  REQUIRE(mesh);
  const auto grid = rasterise(*mesh, 256, even_rows(256));
  REQUIRE_FALSE(grid);
  CHECK(grid.error().code == ErrorCode::corrupt);
}

// The numbers are those of a decoder and a search for triangles in Python (struct, numpy).
TEST_CASE("quantized meshes of a real server: numbers, heights and cover") {
  struct Known {
    const char* file;
    double lowest, highest;
    std::size_t vertices, triangles;
    double mean, north_west, row_5_column_9, south_east;  ///< of 16 x 16 samples
  };
  const Known tiles[] = {
      {"tile.terrain", -156.00425720214844, 6827.119140625, 219, 402, 452.979984, 6.744624, -34.533164, 2403.209647},
      {"tile.octvertexnormals.terrain", -69.31031036376953, 4371.1826171875, 214, 392, -3.038806, 7.305978, -34.554296, -19.488616},
      {"tile.watermask.terrain", -311.2951354980469, 4352.15380859375, 218, 400, -3.016070, 8.373803, -34.412821, -19.399890},
      {"tile.octvertexnormals.watermask.terrain", -311.2951354980469, 4352.15380859375, 218, 400, -3.016070, 8.373803, -34.412821, -19.399890},
      {"tile.metadataavailability.terrain", -109.396728515625, 6827.119140625, 208, 380, 370.771777, 7.327563, -34.567758, 471.653729},
  };
  for (const Known& known : tiles) {
    CAPTURE(known.file);
    const auto bytes = shared_tile(known.file);
    if (!bytes) continue;
    const auto mesh = decode_quantized_mesh(*bytes);
    REQUIRE(mesh);
    CHECK(mesh->lowest == known.lowest);
    CHECK(mesh->highest == known.highest);
    CHECK(mesh->vertices.size() == known.vertices);
    CHECK(mesh->triangles.size() == 3 * known.triangles);
    const auto grid = rasterise(*mesh, 16, even_rows(16));
    REQUIRE(grid);
    double sum = 0;
    for (const float metres : grid->metres) sum += static_cast<double>(metres);
    CHECK(sum / 256 == doctest::Approx(known.mean).epsilon(1e-6));
    CHECK(grid->at(0, 0) == doctest::Approx(known.north_west).epsilon(1e-5));
    CHECK(grid->at(9, 5) == doctest::Approx(known.row_5_column_9).epsilon(1e-5));
    CHECK(grid->at(15, 15) == doctest::Approx(known.south_east).epsilon(1e-5));
    check_against_lookup(*mesh, 100);
  }
}

// What encoded(square()) gives, written by Python's struct and packed by gzip -n -9.
TEST_CASE("decode_quantized_mesh: reads gzipped tiles, and says what is wrong with damaged ones") {
  std::string zipped(
      "\x1f\x8b\x08\x00\x00\x00\x00\x00\x02\x03\x63\x60\x60\x70\x58\x16\x12\xe1\xc8\x80\x0d\xfc\xfb\xef\x06\x61\x7c\xb0\x27\x95"
      "\x66\x81\x1a\xf0\xf7\xff\xbf\xff\x10\x16\x82\xcf\x04\xb7\x80\x91\x01\xc4\x86\xf0\x99\xa0\x34\x44\x8c\x91\x81\x19\x2a\xc7"
      "\xcc\x00\x00\xd2\x88\x07\x19\xa4\x00\x00\x00",
      71);
  const auto mesh = decode_quantized_mesh(zipped);
  REQUIRE(mesh);
  CHECK(mesh->vertices.size() == 4);
  CHECK(mesh->triangles == std::vector<std::uint32_t>{0, 1, 2, 2, 1, 3});
  zipped.resize(zipped.size() / 2);
  CHECK(code_of(zipped) == ErrorCode::corrupt);
}
