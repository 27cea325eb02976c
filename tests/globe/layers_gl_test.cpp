// Layers whose settings and order change while a view shows them: what is seen in the end is what a globe shows that was opened so.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include <unistd.h>

#include <doctest/doctest.h>
#include <fmt/format.h>

#include "globe/globe.h"
#include "globe/globe_view.h"
#include "globe/world_edit.h"
#include "source/made_raster.h"

using namespace tellurion;
using namespace tellurion::globe;
using tellurion::test::MadeFile;
using tellurion::test::MadeRaster;

namespace {

constexpr int kSide = 128;
constexpr std::chrono::seconds kPatience{60};

std::vector<double> waves(double phase, double mean, double swing) {
  std::vector<double> values;
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) values.push_back(std::round(mean + swing * std::sin(phase + 0.3 * row) * std::cos(0.2 * column + phase)));
  }
  return values;
}

/// Ten degrees by ten from `west` E, 40 N.
MadeRaster made(double west, GDALDataType type, std::vector<std::vector<double>> bands) {
  const double step = 10.0 / kSide;
  return {.width = kSide, .height = kSide, .values = std::move(bands), .type = type, .transform = std::array<double, 6>{west, step, 0, 50, 0, -step}};
}

/// Layers of heights (0, 1) and colours (2, 3, 4), partly over one another.
struct Files {
  MadeFile low{"low.tif", made(15, GDT_Int16, {waves(0, 2000, 2000)})};
  MadeFile high{"high.tif", made(18, GDT_Int16, {waves(1, 4000, 1000)})};
  MadeFile red{"red.tif", made(15, GDT_Byte, {waves(0, 180, 60), waves(1, 80, 60), waves(2, 80, 60)})};
  MadeFile green{"green.tif", made(17, GDT_Byte, {waves(1, 80, 60), waves(2, 180, 60), waves(3, 80, 60)})};
  MadeFile blue{"blue.tif", made(19, GDT_Byte, {waves(2, 80, 60), waves(3, 80, 60), waves(4, 180, 60)})};
};

LayerSpec layer_of(const MadeFile& file, LayerGroup group, bool enabled = true) {
  LayerSpec layer;
  layer.name = file.path();
  layer.group = group;
  layer.source.path = file.path();
  if (group == LayerGroup::height) layer.source.vertical = "ellipsoid";
  layer.enabled = enabled;
  return layer;
}

World world_of(const Files& files) {
  World world;
  world.layers = {layer_of(files.low, LayerGroup::height), layer_of(files.high, LayerGroup::height, false), layer_of(files.red, LayerGroup::color),
                  layer_of(files.green, LayerGroup::color), layer_of(files.blue, LayerGroup::color, false)};
  return world;
}

struct Show {
  Show(gpu::RenderThread& thread, const World& world, int workers) {
    GlobeOptions options;
    options.workers = workers;
    auto opened = Globe::open(world, options);
    REQUIRE(opened.has_value());
    globe = std::move(*opened);
    auto made_view = GlobeView::create(*globe, thread, std::size_t{64} << 20);
    REQUIRE(made_view.has_value());
    view = std::move(*made_view);
    view::Pose pose;
    pose.position = {to_radians(Degrees(41.0)), to_radians(Degrees(20.3)), EllipsoidalHeight(300e3)};
    pose.pitch = to_radians(Degrees(-50.0));
    camera = view::make_camera(globe->ellipsoid(), pose, to_radians(Degrees(45.0)), 320, 200);
  }

  std::vector<std::uint8_t> finished_picture() {
    REQUIRE(view->finish(camera, {}, std::chrono::steady_clock::now() + kPatience));
    return view->picture(camera, {}).rgba;
  }

  std::unique_ptr<Globe> globe;
  std::unique_ptr<GlobeView> view;
  view::Camera camera;
};

}  // namespace

TEST_CASE("settings and order of layers that change while they are shown look as if the world had been opened so") {
  const Files files;
  auto thread = gpu::RenderThread::headless(gpu::Api::core);
  REQUIRE(thread.has_value());
  World world = world_of(files);
  Show first(**thread, world, 0), second(**thread, world, 2);
  auto last = first.finished_picture();
  CHECK((second.finished_picture() == last));

  const auto changes_to = [&](const char* what, const std::function<void(Globe&)>& change) {
    CAPTURE(what);
    Show anew(**thread, world, 0);
    const auto expected = anew.finished_picture();
    CHECK((expected != last));
    for (Show* shown : {&first, &second}) {
      change(*shown->globe);
      CHECK((shown->finished_picture() == expected));
    }
    last = expected;
  };
  const auto set = [&](const char* what, std::size_t layer, const std::function<void(LayerSettings&)>& change) {
    change(world.layers[layer]);
    changes_to(what, [&](Globe& globe) { REQUIRE(globe.set_layer(layer, world.layers[layer]).has_value()); });
  };
  set("half transparent", 3, [](LayerSettings& s) { s.opacity = 0.5; });
  set("gamma", 2, [](LayerSettings& s) { s.gamma = 0.6; });
  set("multiplier", 3, [](LayerSettings& s) { s.multiplier = 1.5; });
  set("a picture that was off", 4, [](LayerSettings& s) { s.enabled = true; });
  std::swap(world.layers[3], world.layers[4]);
  changes_to("order", [](Globe& globe) { REQUIRE(globe.move_layer(3, true)); });
  std::swap(world.layers[3], world.layers[4]);
  changes_to("the order before", [](Globe& globe) { REQUIRE(globe.move_layer(4, true)); });
  set("a picture off", 2, [](LayerSettings& s) { s.enabled = false; });
  set("heights that were off", 1, [](LayerSettings& s) { s.enabled = true; });
  set("heights that add", 1, [](LayerSettings& s) { s.adds = true; });
  set("heights off", 0, [](LayerSettings& s) { s.enabled = false; });
}

TEST_CASE("set_layer and move_layer: what cannot be is said, and nothing changes") {
  const Files files;
  World world = world_of(files);
  world.layers.push_back(layer_of(files.blue, LayerGroup::color, false));
  world.layers.back().source.path = "/nowhere/at/all.tif";
  GlobeOptions options;
  options.workers = 0;
  auto globe = std::move(*Globe::open(world, options));
  CHECK(globe->layer_order() == std::vector<std::size_t>{0, 1, 2, 3, 4, 5});
  CHECK_FALSE(globe->move_layer(1, true));   // the next one is of another group
  CHECK_FALSE(globe->move_layer(0, false));
  CHECK_FALSE(globe->move_layer(9, true));
  CHECK(globe->move_layer(2, true));
  CHECK(globe->layer_order() == std::vector<std::size_t>{0, 1, 3, 2, 4, 5});

  LayerSettings settings = globe->layer_settings(2);
  settings.opacity = 1.5;
  CHECK(globe->set_layer(2, settings).error().message == "layer \"" + files.red.path() + "\": `opacity` is 0 to 1, not 1.5");
  settings.opacity = 1.0;
  settings.adds = true;
  CHECK(globe->set_layer(2, settings).error().code == ErrorCode::invalid_argument);
  CHECK(globe->set_layer(9, {}).error().code == ErrorCode::invalid_argument);
  CHECK(globe->layer_settings(2) == LayerSettings{});

  CHECK_FALSE(globe->data_missing());
  REQUIRE(globe->set_layer(5, {}).has_value());
  CHECK_FALSE(globe->catalogues_ready());
  REQUIRE(globe->wait_for_catalogues(std::chrono::steady_clock::now() + kPatience));
  CHECK(globe->data_missing());
  CHECK(globe->source_stats()[5].last_error.find("/nowhere/at/all.tif") != std::string::npos);
}

TEST_CASE("save_layers: settings and order come into the world's file, which else stays as it is, or into a new one") {
  const Files files;
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / fmt::format("tellurion-layers-{}", ::getpid());
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / "mine.toml";
  std::string text = "# Mine.\n";
  for (const MadeFile* picture : {&files.red, &files.green, &files.blue}) text += fmt::format("\n# A picture.\n[[layer]]\ngroup = \"color\"\nsource = {{ path = \"{}\" }}\n", picture->path());
  std::ofstream(file) << text;

  GlobeOptions options;
  options.workers = 0;
  const auto world = load_world(file);
  REQUIRE_MESSAGE(world.has_value(), (world ? std::string() : world.error().message));
  auto globe = std::move(*Globe::open(*world, options));
  LayerSettings settings;
  settings.opacity = 0.5;
  REQUIRE(globe->set_layer(0, settings).has_value());
  REQUIRE(globe->move_layer(0, true));
  REQUIRE(globe->move_layer(0, true));
  const auto saved = save_layers(*globe, folder);
  REQUIRE_MESSAGE(saved.has_value(), (saved ? std::string() : saved.error().message));
  CHECK(*saved == file);
  const World now = *load_world(file);
  REQUIRE(now.layers.size() == 3);
  CHECK(now.layers[0].source.path == files.green.path());
  CHECK(now.layers[1].source.path == files.blue.path());
  CHECK(now.layers[2].source.path == files.red.path());
  CHECK(now.layers[2].opacity == 0.5);
  std::ifstream stream(file);
  const std::string kept(std::istreambuf_iterator<char>(stream), {});
  CHECK(kept.starts_with("# Mine.\n"));
  CHECK(kept.size() == text.size() + std::string("opacity = 0.5\n").size());

  settings.opacity = 0.75;  // again, and the file has another layer meanwhile
  REQUIRE(globe->set_layer(0, settings).has_value());
  std::ofstream(file, std::ios::app) << "\n[[layer]]\nname = \"new\"\ngroup = \"color\"\nsource = { path = \"new.tif\" }\n";
  REQUIRE(save_layers(*globe, folder).has_value());
  CHECK(load_world(file)->layers[2].opacity == 0.75);
  CHECK(load_world(file)->layers[3].name == "new");
  std::ofstream(file) << "[[layer]]\ngroup = \"color\"\nsource = { path = \"other.tif\" }\n";
  const auto gone = save_layers(*globe, folder);
  REQUIRE_FALSE(gone.has_value());
  CHECK(gone.error().message.find("any more as it was opened") != std::string::npos);

  World of_no_file = globe->world();
  of_no_file.file.clear();
  auto other = std::move(*Globe::open(of_no_file, options));
  REQUIRE(other->move_layer(1, true));
  const auto made = save_layers(*other, folder);
  REQUIRE(made.has_value());
  CHECK(*made == folder / "world.toml");
  CHECK(load_world(*made)->layers[2].source.path == files.green.path());
  CHECK(*save_layers(*other, folder) == folder / "world-2.toml");
  std::filesystem::remove_all(folder);
}
