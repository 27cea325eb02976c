// Rasters that come and go while a view shows them: what is seen in the end is what a globe shows that had them from the start.
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "globe/show.h"
#include "source/catalogue/catalogue.h"
#include "source/made_raster.h"

using namespace tellurion;
using namespace tellurion::globe;
using tellurion::globe::test::kPatience;
using tellurion::globe::test::Show;
using tellurion::test::MadeFile;
using tellurion::test::MadeRaster;

namespace {

constexpr int kSide = 128;

/// Ten degrees by ten of hills and of stripes, whose south-west corner lies at `west`, 40 degrees north.
struct Piece {
  static std::vector<double> samples(double phase, double mean, double swing) {
    std::vector<double> values;
    for (int row = 0; row < kSide; ++row) {
      for (int column = 0; column < kSide; ++column) values.push_back(std::round(mean + swing * std::sin(phase + 0.3 * row) * std::cos(0.2 * column)));
    }
    return values;
  }
  static MadeRaster raster(double west, GDALDataType type, std::vector<std::vector<double>> bands) {
    const double step = 10.0 / kSide;
    return {.width = kSide, .height = kSide, .values = std::move(bands), .type = type, .transform = std::array<double, 6>{west, step, 0, 50, 0, -step}};
  }

  Piece(const std::string& name, double west, double phase)
      : heights(name + "_heights.tif", raster(west, GDT_Int16, {samples(phase, 4000, 3000)})),
        colours(name + "_colours.tif", raster(west, GDT_Byte, {samples(phase, 120, 100), samples(phase + 1, 120, 100), samples(phase + 2, 120, 100)})) {}

  MadeFile heights;
  MadeFile colours;
};

World world_of(const std::vector<const Piece*>& pieces) {
  World world;
  for (const LayerGroup group : {LayerGroup::height, LayerGroup::color}) {
    LayerSpec layer;
    layer.name = "pieces";
    layer.group = group;
    layer.source.type = "catalogue";
    for (const Piece* piece : pieces) layer.source.catalogue.files.push_back((group == LayerGroup::height ? piece->heights : piece->colours).path());
    world.layers.push_back(layer);
  }
  return world;
}

/// Over the border of two pieces.
struct Pieces : Show {
  Pieces(gpu::RenderThread& thread, const std::vector<const Piece*>& pieces, int workers) : Show(thread, world_of(pieces), workers) {}

  void insert(const Piece& piece) {
    REQUIRE(globe->insert(0, {piece.heights.path()}).has_value());
    REQUIRE(globe->insert(1, {piece.colours.path()}).has_value());
  }
  void remove(const Piece& piece) {
    REQUIRE(globe->remove(0, {piece.heights.path()}).has_value());
    REQUIRE(globe->remove(1, {piece.colours.path()}).has_value());
  }
};

}  // namespace

TEST_CASE("rasters put into a catalogue and taken out show and vanish, as if they had always been there or never") {
  const Piece west("west", 10.0, 0.0), east("east", 20.0, 1.0);
  auto thread = gpu::RenderThread::headless(gpu::Api::core);
  REQUIRE(thread.has_value());
  Pieces all(**thread, {&west, &east}, 0);
  Pieces one(**thread, {&west}, 0);
  const auto of_all = all.finished_picture();
  const auto of_one = one.finished_picture();
  REQUIRE(of_all != of_one);
  for (const int workers : {0, 2}) {
    CAPTURE(workers);
    Pieces changing(**thread, {&west}, workers);
    changing.insert(east);  // before anything is shown
    CHECK((changing.picture_after_frames() == of_all));
    changing.remove(east);
    CHECK((changing.picture_after_frames() == of_one));
    changing.insert(east);
    CHECK((changing.picture_after_frames() == of_all));
    CHECK(changing.globe->catalogue_of(0)->sets().size() == 2);
  }
}

TEST_CASE("a catalogue that was empty shows what comes, and is empty again when it has gone") {
  const Piece west("first", 10.0, 0.0), east("second", 20.0, 1.0);
  auto thread = gpu::RenderThread::headless(gpu::Api::core);
  REQUIRE(thread.has_value());
  Pieces all(**thread, {&west, &east}, 0);
  const auto of_all = all.finished_picture();
  Pieces changing(**thread, {}, 2);
  const auto of_none = changing.finished_picture();
  changing.insert(east);
  for (int frame = 0; frame < 3; ++frame) (void)changing.view->update(changing.camera, {}, 5.0);  // some tiles without the other
  changing.insert(west);
  CHECK((changing.picture_after_frames() == of_all));
  changing.remove(west);
  changing.remove(east);
  CHECK((changing.finished_picture() == of_none));
}

TEST_CASE("a raster of the same path takes the place of the one before") {
  auto thread = gpu::RenderThread::headless(gpu::Api::core);
  REQUIRE(thread.has_value());
  auto piece = std::make_unique<Piece>("changing", 20.0, 0.0);
  Pieces show(**thread, {piece.get()}, 0);
  const auto before = show.finished_picture();
  piece.reset();
  piece = std::make_unique<Piece>("changing", 20.0, 2.0);
  const auto expected = Pieces(**thread, {piece.get()}, 0).finished_picture();
  REQUIRE(expected != before);
  show.insert(*piece);
  CHECK((show.finished_picture() == expected));
}

TEST_CASE("what is put into a layer that is no catalogue, and a file that is none, are told") {
  auto thread = gpu::RenderThread::headless(gpu::Api::core);
  REQUIRE(thread.has_value());
  const Piece west("only", 10.0, 0.0);
  Pieces show(**thread, {&west}, 0);
  CHECK(show.globe->insert(7, {"a.tif"}).error().code == ErrorCode::invalid_argument);
  CHECK(show.globe->remove(7, {"a.tif"}).error().code == ErrorCode::invalid_argument);
  const auto before = show.finished_picture();
  REQUIRE(show.globe->insert(0, {"/vsimem/gone.tif"}).has_value());
  CHECK((show.finished_picture() == before));
  REQUIRE(show.globe->problems().size() == 1);
  CHECK(show.globe->problems().front().find("/vsimem/gone.tif") != std::string::npos);
  CHECK(show.globe->data_missing());
}

TEST_CASE("a view of a catalogue alone begins over what it has, one of nothing over the whole body") {
  auto thread = gpu::RenderThread::headless(gpu::Api::core);
  REQUIRE(thread.has_value());
  const Piece west("home_west", 10.0, 0.0), east("home_east", 20.0, 1.0);
  Pieces show(**thread, {&west, &east}, 0);
  REQUIRE(show.globe->wait_for_catalogues(std::chrono::steady_clock::now() + kPatience));
  const view::Pose home = show.globe->home();
  CHECK(to_degrees(home.position.latitude).value == doctest::Approx(45.0).epsilon(0.01));  // 40 to 50 north,
  CHECK(to_degrees(home.position.longitude).value == doctest::Approx(20.0).epsilon(0.001));  // 10 to 30 east
  CHECK(home.position.height.value > 1e6);
  CHECK(home.position.height.value < 4e6);
  CHECK(Pieces(**thread, {}, 0).globe->home().position.height.value > 1e7);
}
