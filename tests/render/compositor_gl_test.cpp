// Composed slots against a bilinear reference computed here in double precision.
#include <algorithm>
#include <cmath>
#include <vector>

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/common.hpp>

#include "render/compositor.h"

using namespace tellurion;
using namespace tellurion::render;
using surface::ImagePatch;

namespace {

constexpr int kSide = surface::kColourSlotSide;
constexpr double kInner = kSide - 2 * surface::kColourGutter;

/// A compositor with one slot to draw into.
struct Bench {
  explicit Bench(gpu::Api api) {
    auto made = gpu::RenderThread::headless(api);
    REQUIRE(made.has_value());
    thread = std::move(*made);
    auto created = Compositor::create(*thread);
    REQUIRE(created.has_value());
    compositor.emplace(std::move(*created));
    slot = *pool.acquire(*thread, budget);
  }

  std::vector<std::uint8_t> compose(const std::vector<ImagePatch>& patches, int level = 0) {
    REQUIRE(compositor->compose(*thread, patches, pool, slot, budget).has_value());
    return texels(level);
  }

  std::vector<std::uint8_t> compose_effects(const std::vector<ImagePatch>& patches, int level = 0) {
    REQUIRE(compositor->compose_effects(*thread, patches, pool, slot, budget).has_value());
    return texels(level);
  }

  std::vector<std::uint8_t> texels(int level) {
    const gpu::Framebuffer reader(*thread);
    glBindFramebuffer(GL_FRAMEBUFFER, reader.name());
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, pool.texture(slot), level,
                              static_cast<GLint>(slot.layer));
    const int side = kSide >> level;
    std::vector<std::uint8_t> read(static_cast<std::size_t>(side * side * 4));
    glReadPixels(0, 0, side, side, GL_RGBA, GL_UNSIGNED_BYTE, read.data());
    CHECK(glGetError() == GL_NO_ERROR);
    return read;
  }

  std::unique_ptr<gpu::RenderThread> thread;
  std::optional<Compositor> compositor;
  Budget budget{std::size_t{64} << 20, 0};
  SlotPool pool{{kSide, 9, GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, 4, GL_LINEAR_MIPMAP_LINEAR}, std::size_t{64} << 20};
  Slot slot;
};

/// A smooth picture with detail of a few texels, premultiplied; alpha 255 or varying.
raster::Image smooth_image(int width, int height, bool opaque) {
  raster::Image image{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double alpha = opaque ? 1.0 : 0.5 + 0.5 * std::sin(x * 0.11) * std::cos(y * 0.07);
      const double colours[3] = {0.5 + 0.5 * std::sin(x * 0.31), 0.5 + 0.5 * std::cos(y * 0.23), 0.5 + 0.5 * std::sin((x + y) * 0.17)};
      for (const double c : colours) image.rgba.push_back(static_cast<std::uint8_t>(std::lround(255.0 * c * alpha)));
      image.rgba.push_back(static_cast<std::uint8_t>(std::lround(255.0 * alpha)));
    }
  }
  return image;
}

/// The whole slot from a slightly turned and bent part of an image of `width` x `height`.
ImagePatch bent_patch(int width, int height, bool opaque) {
  ImagePatch patch;
  patch.image = smooth_image(width, height, opaque);
  patch.columns = patch.rows = 16;
  patch.lower = glm::vec2(static_cast<float>(-surface::kColourGutter / kInner));
  patch.upper = glm::vec2(static_cast<float>(1.0 + surface::kColourGutter / kInner));
  patch.opaque = opaque;
  for (int row = 0; row <= 16; ++row) {
    for (int column = 0; column <= 16; ++column) {
      const double s = column / 16.0;
      const double t = row / 16.0;
      patch.image_points.emplace_back(0.1 + 0.7 * s + 0.05 * t * t, 0.05 + 0.8 * t - 0.06 * s * t);
    }
  }
  return patch;
}

using Colour = std::array<double, 4>;

/// Bilinear in `image` at texture coordinates, edges repeated.
Colour sample(const raster::Image& image, glm::dvec2 point) {
  const double x = std::clamp(point.x * image.width - 0.5, 0.0, image.width - 1.0);
  const double y = std::clamp(point.y * image.height - 0.5, 0.0, image.height - 1.0);
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, image.width - 1);
  const int y1 = std::min(y0 + 1, image.height - 1);
  Colour c{};
  for (std::size_t i = 0; i < 4; ++i) {
    const double upper = glm::mix(double(image.at(x0, y0)[i]), double(image.at(x1, y0)[i]), x - x0);
    const double lower = glm::mix(double(image.at(x0, y1)[i]), double(image.at(x1, y1)[i]), x - x0);
    c[i] = glm::mix(upper, lower, y - y0);
  }
  return c;
}

/// What a patch over the whole slot shows at a texel's centre; (column, row) counted from the slot's corner.
Colour patch_colour(const ImagePatch& patch, int column, int row) {
  const glm::dvec2 place(glm::dvec2(column + 0.5, row + 0.5) / double(kSide) * glm::dvec2(patch.columns, patch.rows));
  const glm::ivec2 cell = glm::min(glm::ivec2(place), glm::ivec2(patch.columns - 1, patch.rows - 1));
  const glm::dvec2 in = place - glm::dvec2(cell);
  const auto point = [&](int c, int r) {
    return glm::dvec2(patch.image_points[static_cast<std::size_t>((cell.y + r) * (patch.columns + 1) + cell.x + c)]);
  };
  return sample(patch.image, glm::mix(glm::mix(point(0, 0), point(1, 0), in.x), glm::mix(point(0, 1), point(1, 1), in.x), in.y));
}

struct Difference {
  double mean = 0;
  double share_beyond_4 = 0;
};

template <class Expected>
Difference compare(const std::vector<std::uint8_t>& texels, const Expected& expected) {
  Difference d;
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) {
      const Colour wanted = expected(column, row);
      for (std::size_t i = 0; i < 4; ++i) {
        const double error = std::abs(wanted[i] - texels[static_cast<std::size_t>(row * kSide + column) * 4 + i]);
        d.mean += error;
        d.share_beyond_4 += error > 4.0 ? 1.0 : 0.0;
      }
    }
  }
  const double count = double(kSide) * kSide * 4;
  return {d.mean / count, d.share_beyond_4 / count};
}

ImagePatch plain_patch(std::array<std::uint8_t, 4> colour, bool opaque, glm::vec2 lower, glm::vec2 upper) {
  ImagePatch patch;
  patch.image = {1, 1, {colour.begin(), colour.end()}};
  patch.columns = patch.rows = 1;
  patch.lower = lower;
  patch.upper = upper;
  patch.image_points = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  patch.opaque = opaque;
  return patch;
}

constexpr glm::vec2 kAllLower(-0.1f);  // beyond the gutter
constexpr glm::vec2 kAllUpper(1.1f);

std::array<int, 4> texel(const std::vector<std::uint8_t>& texels, int column, int row) {
  const std::size_t o = static_cast<std::size_t>(row * kSide + column) * 4;
  return {texels[o], texels[o + 1], texels[o + 2], texels[o + 3]};
}

bool near(const std::array<int, 4>& a, const std::array<int, 4>& b, int tolerance) {
  for (std::size_t i = 0; i < 4; ++i)
    if (std::abs(a[i] - b[i]) > tolerance) return false;
  return true;
}

}  // namespace

TEST_CASE("compose: a bent patch agrees with bilinear sampling in double precision") {
  for (const gpu::Api api : {gpu::Api::core, gpu::Api::es}) {
    Bench bench(api);
    for (const bool opaque : {true, false}) {
      const ImagePatch patch = bent_patch(300, 200, opaque);  // no power of two: the image fills part of its texture
      const auto difference = compare(bench.compose({patch}), [&](int c, int r) { return patch_colour(patch, c, r); });
      CHECK(difference.mean <= 1.0);
      CHECK(difference.share_beyond_4 <= 0.001);
    }
  }
}

TEST_CASE("compose: of an image that is finer than the slot, the mean under a texel is shown") {
  // Columns of black and white, two a texel of the slot: interpolated at one place they would be black, grey or white by where that lies.
  Bench bench(gpu::Api::core);
  for (const double shift : {0.0, 0.25, 0.5}) {
    ImagePatch patch = plain_patch({0, 0, 0, 255}, true, kAllLower, kAllUpper);
    patch.image = {600, 4, {}};
    for (int i = 0; i < 600 * 4; ++i) {
      for (int channel = 0; channel < 3; ++channel) patch.image.rgba.push_back(i % 2 ? 255 : 0);
      patch.image.rgba.push_back(255);
    }
    const auto left = static_cast<float>((20.0 + shift) / 600.0), right = static_cast<float>(left + 2.0 * 1.2 * kInner / 600.0);
    patch.image_points = {{left, 0.4f}, {right, 0.4f}, {left, 0.6f}, {right, 0.6f}};
    const auto texels = bench.compose({patch});
    for (int column = 1; column < kSide - 1; ++column) CHECK(near(texel(texels, column, 100), {128, 128, 128, 255}, 2));
  }
}

TEST_CASE("compose: beyond a raster's border its last pixel fades over one pixel, or over a texel if that is larger") {
  Bench bench(gpu::Api::core);
  for (const double pixel : {0.25, 8.0}) {  // texels of the slot
    ImagePatch patch = plain_patch({200, 100, 50, 255}, false, glm::vec2(0.0f), glm::vec2(1.0f));
    patch.data_upper = {0.5f, surface::kUnbounded};
    patch.data_pixel = glm::vec2(static_cast<float>(pixel / kInner));
    const auto texels = bench.compose({patch});
    for (int column = surface::kColourGutter; column < kSide - surface::kColourGutter; ++column) {
      const double beyond = column + 0.5 - surface::kColourGutter - 0.5 * kInner;
      const double alpha = 255.0 * (1.0 - std::clamp(beyond / std::max(pixel, 1.0), 0.0, 1.0));
      CHECK(std::abs(texel(texels, column, 100)[3] - alpha) <= 1.0);
    }
  }
}

TEST_CASE("compose: with a feather a raster fades inwards from its border, over a texel at least, by the nearer side in a corner") {
  for (const gpu::Api api : {gpu::Api::core, gpu::Api::es}) {
    Bench bench(api);
    for (const double feather : {0.25, 30.0, 5000.0}) {  // texels of the slot
      CAPTURE(feather);
      ImagePatch patch = plain_patch({255, 255, 255, 255}, false, glm::vec2(0.0f), glm::vec2(1.0f));
      patch.data_upper = {0.5f, 0.75f};
      patch.data_pixel = glm::vec2(static_cast<float>(1.0 / kInner));
      patch.feather = glm::vec2(static_cast<float>(feather / kInner));
      const auto texels = bench.compose({plain_patch({0, 0, 0, 255}, true, kAllLower, kAllUpper), patch});
      int in_corner = 0;
      for (int row = surface::kColourGutter; row < kSide - surface::kColourGutter; ++row) {
        for (int column = surface::kColourGutter; column < kSide - surface::kColourGutter; ++column) {
          const double x = 0.5 * kInner - (column + 0.5 - surface::kColourGutter), y = 0.75 * kInner - (row + 0.5 - surface::kColourGutter);
          const double white = 255.0 * std::clamp(std::min(x, y) / std::max(feather, 1.0), 0.0, 1.0);
          REQUIRE(std::abs(texel(texels, column, row)[0] - white) <= 1.0);
          if (x < 0.0 || y < 0.0) REQUIRE(texel(texels, column, row)[0] == 0);
          in_corner += x > 0.0 && y > 0.0 && x < feather && y < feather;
        }
      }
      if (feather > 1.0) CHECK(in_corner >= 800);
    }
  }
}

TEST_CASE("compose: a translucent patch over an opaque one adds up as premultiplied colours do") {
  Bench bench(gpu::Api::core);
  const ImagePatch below = bent_patch(256, 256, true);
  ImagePatch above = bent_patch(200, 300, false);
  above.opacity = 0.6f;
  const auto difference = compare(bench.compose({below, above}), [&](int c, int r) {
    const Colour under = patch_colour(below, c, r);
    Colour over = patch_colour(above, c, r);
    Colour sum{};
    for (std::size_t i = 0; i < 4; ++i) sum[i] = 0.6 * over[i] + under[i] * (1.0 - 0.6 * over[3] / 255.0);
    return sum;
  });
  CHECK(difference.mean <= 1.0);
  CHECK(difference.share_beyond_4 <= 0.001);
}

TEST_CASE("compose: edges of an image do not mix with what an earlier one left in the texture") {
  Bench bench(gpu::Api::core);
  bench.compose({plain_patch({255, 0, 0, 255}, true, kAllLower, kAllUpper)});
  ImagePatch white = plain_patch({255, 255, 255, 255}, true, kAllLower, kAllUpper);
  white.image = {70, 70, std::vector<std::uint8_t>(70 * 70 * 4, 255)};
  bench.compose({plain_patch({0, 0, 0, 255}, true, kAllLower, kAllUpper)});
  ImagePatch large = white;
  large.image = {128, 128, std::vector<std::uint8_t>(128 * 128 * 4, 0)};
  bench.compose({large});
  const auto texels = bench.compose({white});
  CHECK(std::all_of(texels.begin(), texels.end(), [](std::uint8_t v) { return v == 255; }));
}

TEST_CASE("compose: a slot used again keeps nothing of what it held") {
  Bench bench(gpu::Api::core);
  bench.compose({plain_patch({255, 255, 255, 255}, true, kAllLower, kAllUpper)});
  const auto texels = bench.compose({plain_patch({0, 128, 0, 255}, true, {0.25f, 0.25f}, {0.5f, 0.5f})});
  CHECK(texel(texels, 2, 2) == std::array<int, 4>{0, 0, 0, 0});
  CHECK(texel(texels, 96, 96) == std::array<int, 4>{0, 128, 0, 255});
  CHECK(texel(bench.compose({}), 96, 96) == std::array<int, 4>{0, 0, 0, 0});
}

TEST_CASE("compose: lower tile coordinates lie at lower texels, behind the gutter") {
  Bench bench(gpu::Api::core);
  const auto texels = bench.compose({plain_patch({200, 100, 50, 255}, true, {0.0f, 0.0f}, {0.5f, 0.25f})});
  CHECK(texel(texels, 4, 4)[3] == 255);     // first texel of the tile
  CHECK(texel(texels, 3, 4)[3] == 0);       // gutter
  CHECK(texel(texels, 127, 65)[3] == 255);  // 4 + 248 * (0.5, 0.25) = (128, 66): last texels inside
  CHECK(texel(texels, 128, 65)[3] == 0);
  CHECK(texel(texels, 127, 66)[3] == 0);
}

TEST_CASE("compose: what an opaque patch hides is not drawn, and what lies on it is") {
  Bench bench(gpu::Api::core);
  ImagePatch hidden = plain_patch({255, 0, 0, 255}, false, kAllLower, kAllUpper);
  const auto half = plain_patch({64, 64, 64, 128}, false, kAllLower, kAllUpper);
  const auto texels = bench.compose({hidden, plain_patch({0, 0, 200, 255}, true, kAllLower, kAllUpper), half});
  // 64 + (0, 0, 200) * (1 - 128/255), by hand
  CHECK(near(texel(texels, 100, 100), {64, 64, 164, 255}, 1));
}

TEST_CASE("compose: gamma and multiplier act on colours without their alpha, opacity on all") {
  Bench bench(gpu::Api::core);
  ImagePatch patch = plain_patch({64, 32, 96, 128}, false, kAllLower, kAllUpper);
  patch.gamma = 2.0f;
  patch.multiplier = 1.5f;
  patch.opacity = 0.5f;
  // By hand: c = v / 128, then c^2 * 1.5 (at most 1) * 128 * 0.5.
  const auto texels = bench.compose({patch});
  CHECK(near(texel(texels, 50, 50), {24, 6, 54, 64}, 1));
}

TEST_CASE("compose: nearest filtering gives the image's own values") {
  Bench bench(gpu::Api::core);
  ImagePatch patch = plain_patch({}, true, kAllLower, kAllUpper);
  patch.image = {2, 1, {10, 20, 30, 255, 200, 210, 220, 255}};
  patch.linear = false;
  const auto texels = bench.compose({patch});
  CHECK(texel(texels, 120, 10) == std::array<int, 4>{10, 20, 30, 255});
  CHECK(texel(texels, 135, 10) == std::array<int, 4>{200, 210, 220, 255});
}

TEST_CASE("compose: smaller levels are means of the larger ones") {
  Bench bench(gpu::Api::core);
  const ImagePatch patch = bent_patch(256, 256, true);
  const auto fine = bench.compose({patch}, 0);
  const auto coarse = bench.compose({patch}, 3);
  double worst = 0;
  for (int row = 0; row < kSide / 8; ++row) {
    for (int column = 0; column < kSide / 8; ++column) {
      double sum = 0;
      for (int i = 0; i < 64; ++i) sum += texel(fine, column * 8 + i % 8, row * 8 + i / 8)[0];
      const auto o = static_cast<std::size_t>(row * (kSide / 8) + column) * 4;
      worst = std::max(worst, std::abs(sum / 64 - coarse[o]));
    }
  }
  CHECK(worst <= 1.5);  // three roundings
}

TEST_CASE("compose: textures for images are few, and counted") {
  Bench bench(gpu::Api::core);
  const std::size_t slots = bench.budget.used;
  for (int width = 1; width <= 2048; width *= 2) {
    ImagePatch patch = plain_patch({}, true, kAllLower, kAllUpper);
    patch.image = {width, 3, std::vector<std::uint8_t>(static_cast<std::size_t>(width) * 12, 255)};
    bench.compose({patch});
    bench.compose({patch});
  }
  // Widths 64 to 2048 in a height of 64, at 4 bytes.
  CHECK(bench.budget.used - slots == std::size_t{64} * (64 + 128 + 256 + 512 + 1024 + 2048) * 4);
}

TEST_CASE("compose_effects: water with a feather passes into the water below, and the light beside it stays") {
  Bench bench(gpu::Api::core);
  auto city = plain_patch({200, 100, 50, 255}, true, kAllLower, kAllUpper), sea = plain_patch({255, 255, 255, 255}, true, kAllLower, kAllUpper);
  auto land = plain_patch({0, 0, 0, 255}, false, glm::vec2(0.0f), glm::vec2(1.0f));
  city.use = surface::ImageUse::night;
  sea.use = land.use = surface::ImageUse::water;
  land.data_upper = {0.5f, surface::kUnbounded};
  land.feather = glm::vec2(static_cast<float>(40.0 / kInner));
  land.opacity = 0.8f;
  const auto texels = bench.compose_effects({city, sea, land});
  for (int column = surface::kColourGutter; column < kSide - surface::kColourGutter; ++column) {
    const double inside = 0.5 * kInner - (column + 0.5 - surface::kColourGutter);
    const double water = 255.0 * (1.0 - 0.8 * std::clamp(inside / 40.0, 0.0, 1.0));
    const auto found = texel(texels, column, 100);
    CHECK(std::abs(found[3] - water) <= 1.0);
    CHECK(found[0] == 200);
  }
}

TEST_CASE("compose_effects: light by night in red, green and blue, water in alpha, and neither touches the other") {
  for (const gpu::Api api : {gpu::Api::core, gpu::Api::es}) {
    Bench bench(api);
    bench.compose({plain_patch({10, 20, 30, 255}, true, kAllLower, kAllUpper)});  // a slot used again keeps nothing of this
    auto city = plain_patch({200, 100, 50, 255}, true, kAllLower, kAllUpper), haze = plain_patch({64, 64, 64, 128}, false, kAllLower, kAllUpper);
    city.use = haze.use = surface::ImageUse::night;
    auto sea = plain_patch({255, 255, 255, 255}, true, kAllLower, {0.75f, 1.1f}), land = plain_patch({0, 0, 0, 255}, true, kAllLower, {0.25f, 1.1f}),
         unknown = plain_patch({0, 0, 0, 0}, false, kAllLower, kAllUpper);
    sea.use = land.use = unknown.use = surface::ImageUse::water;
    land.opacity = 0.5f;
    const auto texels = bench.compose_effects({city, sea, haze, land, unknown});
    // 64 + c * (1 - 128/255), by hand; water: half of the sea, the sea, nothing
    CHECK(near(texel(texels, 20, 100), {164, 114, 89, 128}, 1));
    CHECK(near(texel(texels, 128, 100), {164, 114, 89, 255}, 1));
    CHECK(near(texel(texels, 230, 100), {164, 114, 89, 0}, 1));
    sea.gamma = 2.0f;
    sea.image.rgba = {128, 128, 128, 255};
    CHECK(near(texel(bench.compose_effects({sea}), 128, 100), {0, 0, 0, 64}, 1));
    CHECK(near(texel(bench.compose_effects({sea}), 230, 100), {0, 0, 0, 0}, 0));
  }
}

TEST_CASE("compose: grayscale becomes the V of HSV of what lies below it, by its opacity and where it is") {
  for (const gpu::Api api : {gpu::Api::core, gpu::Api::es}) {
    Bench bench(api);
    const auto ground = plain_patch({200, 100, 50, 255}, true, kAllLower, {0.75f, 1.1f});
    const auto lake = plain_patch({0, 0, 0, 255}, true, kAllLower, {0.25f, 1.1f});
    auto relief = plain_patch({100, 100, 100, 255}, true, kAllLower, kAllUpper);
    relief.use = surface::ImageUse::grayscale;
    const auto texels = bench.compose({ground, lake, relief});
    CHECK(near(texel(texels, 128, 100), {100, 50, 25, 255}, 1));    // hue 20 degrees and saturation 0.75 stay
    CHECK(near(texel(texels, 20, 100), {100, 100, 100, 255}, 1));   // black has no hue
    CHECK(near(texel(texels, 230, 100), {100, 100, 100, 255}, 1));  // nor has nothing
    relief.opacity = 0.5f;
    CHECK(near(texel(bench.compose({ground, relief}), 128, 100), {150, 75, 38, 255}, 1));
    CHECK(near(texel(bench.compose({ground, relief}), 230, 100), {50, 50, 50, 128}, 1));
    relief.opacity = 1.0f;
    relief.gamma = 2.0f;
    relief.multiplier = 2.0f;
    CHECK(near(texel(bench.compose({ground, relief}), 128, 100), {78, 39, 20, 255}, 1));  // 2 * 100^2 / 255
    relief.gamma = relief.multiplier = 1.0f;
    relief.opaque = false;
    relief.image.rgba = {50, 50, 50, 128};
    CHECK(near(texel(bench.compose({ground, relief}), 128, 100), {150, 75, 38, 255}, 1));
    const auto half_there = plain_patch({100, 50, 25, 128}, false, kAllLower, kAllUpper);
    relief.opaque = true;
    relief.image.rgba = {100, 100, 100, 255};
    CHECK(near(texel(bench.compose({half_there, relief}), 128, 100), {100, 75, 62, 255}, 1));  // tinted by half
  }
}
