// Layers whose settings and order change while a view shows them: what is seen in the end is what a globe shows that was opened so.
#include <algorithm>
#include <array>
#include <atomic>
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

#include <cpl_conv.h>
#include <doctest/doctest.h>
#include <fmt/format.h>

#include "globe/show.h"
#include "globe/world_edit.h"
#include "source/drawn_source.h"
#include "source/made_raster.h"
#include "surface/made_world.h"

using namespace tellurion;
using namespace tellurion::globe;
using tellurion::globe::test::kPatience;
using tellurion::globe::test::Show;
using tellurion::test::MadeFile;
using tellurion::test::MadeRaster;

namespace {

constexpr int kSide = 128;

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
  set("feather", 3, [](LayerSettings& s) { s.feather = 25.0; });
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
  settings.feather = -1.0;
  CHECK(globe->set_layer(2, settings).error().message == "layer \"" + files.red.path() + "\": `feather` is 0 to 100000, not -1");
  settings.feather = 0.0;
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

TEST_CASE("layers that are added and removed while they are shown look as if the world had been opened so") {
  const Files files;
  auto thread = gpu::RenderThread::headless(gpu::Api::core);
  REQUIRE(thread.has_value());
  const LayerSpec low = layer_of(files.low, LayerGroup::height), high = layer_of(files.high, LayerGroup::height);
  const LayerSpec red = layer_of(files.red, LayerGroup::color), green = layer_of(files.green, LayerGroup::color);
  LayerSpec blue = layer_of(files.blue, LayerGroup::overlay);
  LayerSpec catalogue = layer_of(files.blue, LayerGroup::color);
  catalogue.source.type = "catalogue";
  catalogue.source.path.clear();
  catalogue.source.catalogue.files = {files.blue.path()};

  const auto picture_of = [&](const std::vector<LayerSpec>& layers) {
    World world;
    world.layers = layers;
    return Show(**thread, world, 0).finished_picture();
  };
  World world;
  world.layers = {low, red};
  Show first(**thread, world, 0), second(**thread, world, 2);
  auto last = first.finished_picture();
  CHECK((second.finished_picture() == last));
  const auto changes_to = [&](const std::vector<LayerSpec>& layers, const std::string& what, const std::function<void(Globe&)>& change) {
    CAPTURE(what);
    const auto expected = picture_of(layers);
    CHECK((expected != last));
    for (Show* shown : {&first, &second}) {
      change(*shown->globe);
      CHECK((shown->picture_after_frames() == expected));
    }
    last = expected;
  };
  const auto add = [](const LayerSpec& spec, std::size_t number) {
    return [&spec, number](Globe& globe) { CHECK(globe.add_layer(spec).value() == number); };
  };
  const auto remove = [](std::size_t number) {
    return [number](Globe& globe) { CHECK(globe.remove_layer(number).has_value()); };
  };
  changes_to({low, red, green}, "a picture more", add(green, 2));
  changes_to({low, high, red, green}, "heights more", add(high, 3));
  changes_to({low, high, green}, "a picture less", remove(1));
  changes_to({high, green}, "heights less", remove(0));
  changes_to({high, green, red}, "the picture again", add(red, 4));
  changes_to({high, green, red, catalogue}, "a catalogue more", add(catalogue, 5));
  changes_to({high, green, red, catalogue, blue}, "the first overlay", add(blue, 6));
  changes_to({high, green, red, blue}, "a catalogue less", remove(5));
  CHECK(first.globe->layer_order() == std::vector<std::size_t>{3, 2, 4, 6});
  CHECK(first.globe->layer_count() == 7);
  changes_to({high, red, green, blue}, "their order", [](Globe& globe) { CHECK(globe.move_layer(2, true)); });
  blue.opacity = 0.5;
  changes_to({high, red, green, blue}, "settings of one that came later", [&](Globe& globe) { CHECK(globe.set_layer(6, blue).has_value()); });
  changes_to({}, "all gone", [](Globe& globe) {
    for (const std::size_t layer : globe.layer_order()) CHECK(globe.remove_layer(layer).has_value());
  });
}

TEST_CASE("a picture that comes and goes has no tile made anew that it does not touch") {
  const Files files;
  MadeRaster antipodes = made(-165, GDT_Byte, {waves(0, 180, 60), waves(1, 80, 60), waves(2, 80, 60)});
  (*antipodes.transform)[3] = -20;
  const MadeFile far{"far.tif", antipodes};
  auto thread = gpu::RenderThread::headless(gpu::Api::core);
  REQUIRE(thread.has_value());
  Show show(**thread, world_of(files), 2);
  const auto before = show.finished_picture();
  const auto requests = show.view->stats().requests;
  const std::size_t added = show.globe->add_layer(layer_of(far, LayerGroup::color)).value();
  CHECK((show.finished_picture() == before));
  CHECK(show.view->stats().requests == requests);
  REQUIRE(show.globe->remove_layer(added).has_value());
  CHECK((show.finished_picture() == before));
  CHECK(show.view->stats().requests == requests);
  REQUIRE(show.globe->add_layer(layer_of(files.blue, LayerGroup::color)).has_value());
  CHECK((show.finished_picture() != before));
  CHECK(show.view->stats().requests > requests);
}

TEST_CASE("a layer that comes, goes and changes before it is open leaves no trace") {
  const Files files;
  auto thread = gpu::RenderThread::headless(gpu::Api::core);
  REQUIRE(thread.has_value());
  World world = world_of(files);
  const auto before = Show(**thread, world, 0).finished_picture();
  for (const int workers : {0, 2}) {
    CAPTURE(workers);
    Show show(**thread, world, workers);
    for (int i = 0; i < 10; ++i) {
      const std::size_t colours = show.globe->add_layer(layer_of(files.blue, LayerGroup::color)).value();
      const std::size_t heights = show.globe->add_layer(layer_of(files.high, LayerGroup::height)).value();
      if (i % 2 == 0) (void)show.view->update(show.camera, {}, 5.0);
      CHECK(show.globe->move_layer(colours, false));
      CHECK(show.globe->remove_layer(heights).has_value());
      CHECK(show.globe->remove_layer(colours).has_value());
    }
    CHECK((show.finished_picture() == before));
    CHECK(show.globe->layer_order().size() == world.layers.size());
  }
}

TEST_CASE("tables of heights that were kept are found again by heights that come later") {
  const Files files;
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / fmt::format("tellurion-tables-{}", ::getpid());
  auto thread = gpu::RenderThread::headless(gpu::Api::core);
  REQUIRE(thread.has_value());
  World world = world_of(files);
  world.layers[1].enabled = true;
  const auto expected = Show(**thread, world, 0, folder).finished_picture();
  world.layers.erase(world.layers.begin() + 1);
  Show later(**thread, world, 0, folder);
  (void)later.finished_picture();
  REQUIRE(later.globe->add_layer(layer_of(files.high, LayerGroup::height)).has_value());
  CHECK_FALSE(later.globe->catalogues_ready());
  int jobs = 0;
  while (later.globe->run_one()) ++jobs;
  CHECK(jobs == 2);  // opens it, loads the table: nothing is scanned
  CHECK(later.globe->tables_ready());
  CHECK((later.finished_picture() == expected));
  std::filesystem::remove_all(folder);
}

TEST_CASE("add_layer, remove_layer and add_data: what cannot be is said") {
  const Files files;
  for (const int workers : {0, 2}) {
    CAPTURE(workers);
    GlobeOptions options;
    options.workers = workers;
    auto globe = std::move(*Globe::open(world_of(files), options));
    const auto wait = [&] { REQUIRE(globe->wait_for_catalogues(std::chrono::steady_clock::now() + kPatience)); };
    LayerSpec wrong = layer_of(files.red, LayerGroup::color);
    wrong.opacity = 2.0;
    CHECK(globe->add_layer(wrong).error().message == "layer \"" + files.red.path() + "\": `opacity` is 0 to 1, not 2");
    CHECK(globe->layer_count() == 5);
    CHECK(globe->remove_layer(5).error().code == ErrorCode::invalid_argument);
    CHECK(globe->remove_layer(3).has_value());
    CHECK(globe->remove_layer(3).error().code == ErrorCode::invalid_argument);
    CHECK(globe->set_layer(3, {}).error().message == "layer 3 has been removed");
    CHECK_FALSE(globe->move_layer(3, true));
    CHECK_FALSE(globe->layer_settings(3).enabled);
    CHECK(globe->raster_at(3, {}) == nullptr);

    LayerSpec nowhere = layer_of(files.red, LayerGroup::color);
    nowhere.source.path = "/nowhere/at/all.tif";
    const std::size_t lost = globe->add_layer(nowhere).value();
    wait();
    CHECK(globe->source_stats()[lost].last_error.find("/nowhere/at/all.tif") != std::string::npos);
    REQUIRE(globe->hints().size() == 1);
    CHECK(globe->hints().front().find("/nowhere/at/all.tif") != std::string::npos);
    CHECK(globe->data_missing());
    CHECK(globe->remove_layer(lost).has_value());
    CHECK(globe->hints().empty());
    CHECK_FALSE(globe->data_missing());

    nowhere.source.type = "catalogue";
    const std::size_t list = globe->add_layer(nowhere).value();
    wait();
    CHECK(globe->insert(list, {files.red.path()}).error().code == ErrorCode::invalid_argument);
    CHECK(globe->remove_layer(list).has_value());

    std::vector<AddedData> added;
    globe->add_data({files.red.path(), "/nowhere/at/all.tif", "world.toml", files.red.path(), files.high.path()}, [&](const std::vector<AddedData>& all) { added = all; });
    wait();
    REQUIRE(added.size() == 5);
    REQUIRE(added[0].layer.has_value());
    CHECK(globe->layer(added[0].layer.value()).spec.group == LayerGroup::color);
    CHECK(globe->shown_raster(added[0].layer.value()) != nullptr);
    CHECK(added[1].layer.error().message.find("/nowhere/at/all.tif") != std::string::npos);
    CHECK(added[2].layer.error().message.find("world.toml: a world file") != std::string::npos);
    const std::string name = globe->layer(added[0].layer.value()).spec.name;
    CHECK(globe->layer(added[3].layer.value()).spec.name == name + " 2");
    CHECK(globe->layer(added[4].layer.value()).spec.group == LayerGroup::height);
    CHECK(globe->layer_order() == std::vector<std::size_t>{0, 1, added[4].layer.value(), 2, 4, added[0].layer.value(), added[3].layer.value()});
    CHECK_FALSE(globe->data_missing());
  }
}

TEST_CASE("add_data: what lies on another body is no layer of this one") {
  const Files files;
  World mars;
  mars.planet = "Mars";
  mars.ellipsoid = geo::kMars;
  GlobeOptions options;
  options.workers = 0;
  auto globe = std::move(*Globe::open(mars, options));
  std::string told;
  globe->add_data({files.red.path()}, [&](const std::vector<AddedData>& all) { told = all.front().layer.error().message; });
  REQUIRE(globe->wait_for_catalogues(std::chrono::steady_clock::now() + kPatience));
  CHECK(told.ends_with("lies on Earth, but this is a world of Mars"));
  CHECK(globe->layer_order().empty());
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
  REQUIRE(other->move_layer(1, false));
  CHECK(*save_layers(*other, folder) == folder / "world.toml");  // the same again
  CHECK(load_world(*made)->layers[1].source.path == files.green.path());
  CHECK_FALSE(std::filesystem::exists(folder / "world-2.toml"));
  auto another = std::move(*Globe::open(of_no_file, options));
  CHECK(*save_layers(*another, folder) == folder / "world-2.toml");
  std::filesystem::remove_all(folder);
}

TEST_CASE("save_layers: layers that were added come into the world's file, and those that were removed go out of it") {
  const Files files;
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / fmt::format("tellurion-more-layers-{}", ::getpid());
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / "mine.toml";
  std::string text = "# Mine.\n";
  for (const MadeFile* picture : {&files.red, &files.green}) text += fmt::format("\n# A picture.\n[[layer]]\ngroup = \"color\"\nsource = {{ path = \"{}\" }}\n", picture->path());
  std::ofstream(file) << text;
  GlobeOptions options;
  options.workers = 0;
  auto globe = std::move(*Globe::open(*load_world(file), options));
  const auto saved = [&] {
    const auto where = save_layers(*globe, folder);
    REQUIRE_MESSAGE(where.has_value(), (where ? std::string() : where.error().message));
    CHECK(*where == file);
    std::vector<std::string> names;
    const World now = *load_world(file);
    for (const LayerSpec& layer : now.layers) names.push_back(std::filesystem::path(layer.name).stem().string());
    return names;
  };
  using Names = std::vector<std::string>;
  LayerSpec blue = layer_of(files.blue, LayerGroup::color);
  blue.opacity = 0.25;
  const std::size_t added = globe->add_layer(blue).value();
  const std::size_t heights = globe->add_layer(layer_of(files.low, LayerGroup::height)).value();
  CHECK(saved() == Names{"red", "green", "low", "blue"});
  CHECK(load_world(file)->layers[3].opacity == 0.25);
  CHECK(saved() == Names{"red", "green", "low", "blue"});  // not once more
  REQUIRE(globe->move_layer(added, false));
  REQUIRE(globe->remove_layer(0).has_value());
  CHECK(saved() == Names{"low", "blue", "green"});
  REQUIRE(globe->remove_layer(added).has_value());
  REQUIRE(globe->remove_layer(heights).has_value());
  CHECK(saved() == Names{"green"});
  std::ifstream stream(file);
  CHECK(std::string(std::istreambuf_iterator<char>(stream), {}).starts_with("# Mine.\n\n# A picture.\n[[layer]]"));
  // One that was never saved is not looked for, be there one like it; nor is one that somebody else has removed.
  const std::size_t passing = globe->add_layer(blue).value();
  std::ofstream(file, std::ios::app) << fmt::format("\n[[layer]]\nname = \"{0}\"\ngroup = \"color\"\nsource = {{ path = \"{0}\" }}\n", files.blue.path());
  REQUIRE(globe->remove_layer(passing).has_value());
  CHECK(saved() == Names{"green", "blue"});
  std::ofstream(file) << "# Empty.\n";
  REQUIRE(globe->remove_layer(1).has_value());
  CHECK(saved().empty());
  std::filesystem::remove_all(folder);
}

TEST_CASE("heights whose server does not answer are left out, and shown once it does") {
  const Files files;
  auto thread = gpu::RenderThread::headless(gpu::Api::core);
  REQUIRE(thread.has_value());
  World world;
  world.layers = {layer_of(files.low, LayerGroup::height), layer_of(files.red, LayerGroup::color)};
  const auto without = Show(**thread, world, 2).finished_picture();
  const auto server = std::make_shared<std::atomic<bool>>(true);
  surface::testing::MadeRaster remote;
  remote.server = server;
  remote.metres = [](int x, int y) { return surface::testing::noise(x, y, 7, 5000, 60000); };
  LayerSpec far;
  far.name = "far";
  far.group = LayerGroup::height;
  far.source.raster = std::make_shared<surface::testing::MadeSource>(remote);
  world.layers.push_back(far);
  const auto with = Show(**thread, world, 2).finished_picture();
  const auto difference = [](const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
    return sum / static_cast<double>(a.size());
  };
  REQUIRE(difference(with, without) > 5);

  *server = false;
  Show show(**thread, world, 2);
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  double lacking = 0;
  do {
    for (int frame = 0; frame < 20; ++frame) (void)show.view->update(show.camera, {}, 5.0);
    lacking = difference(show.view->picture(show.camera, {}).rgba, without);
  } while (lacking > 0.5 && std::chrono::steady_clock::now() < deadline);
  CHECK(lacking <= 0.5);
  CHECK_FALSE(show.view->stats().complete);
  *server = true;
  CHECK((show.picture_after_frames() == with));
}

TEST_CASE("refresh_layer: what a program draws, and a file that has changed, show as they are now") {
  const Files files;
  const std::filesystem::path file = std::filesystem::temp_directory_path() / fmt::format("tellurion-changing-{}.tif", ::getpid());
  const auto copy = [&](const MadeFile& from) { REQUIRE(CPLCopyFile(file.c_str(), from.path().c_str()) == 0); };
  copy(files.red);
  const auto brightness = std::make_shared<std::atomic<int>>(200);
  source::Drawing drawing;
  drawing.name = "weather";
  drawing.georeference = {"EPSG:4326", {16.0, 8.0 / 512, 0.0, 49.0, 0.0, -8.0 / 512}, 512, 512};
  drawing.levels = source::halved_levels({512, 512});
  drawing.draw = [brightness](int, const source::PixelWindow& window) {
    raster::Image image{window.width, window.height, {}};
    const auto grey = static_cast<std::uint8_t>(*brightness);
    for (int i = 0; i < window.width * window.height; ++i) image.rgba.insert(image.rgba.end(), {grey, grey, 0, 255});
    return image;
  };
  LayerSpec drawn;
  drawn.name = "weather";
  drawn.source.raster = std::move(*source::open_drawing(drawing, geo::kWgs84));
  LayerSpec changing = layer_of(files.red, LayerGroup::color);
  changing.source.path = file;
  World world;
  world.layers = {layer_of(files.low, LayerGroup::height), changing, drawn};
  auto thread = gpu::RenderThread::headless(gpu::Api::core);
  REQUIRE(thread.has_value());
  Show first(**thread, world, 0), second(**thread, world, 2);
  auto last = first.finished_picture();
  CHECK((second.finished_picture() == last));
  const auto refreshed = [&](std::size_t layer) {
    const auto expected = Show(**thread, world, 0).finished_picture();
    CHECK((expected != last));
    for (Show* shown : {&first, &second}) {
      REQUIRE(shown->globe->refresh_layer(layer).has_value());
      CHECK((shown->finished_picture() == expected));
    }
    last = expected;
  };
  for (const int next : {40, 120}) {
    *brightness = next;
    refreshed(2);
  }
  copy(files.green);
  refreshed(1);
  // One that cannot be opened any more is shown as it was.
  std::filesystem::remove(file);
  REQUIRE(first.globe->refresh_layer(1).has_value());
  CHECK((first.finished_picture() == last));
  CHECK(first.globe->source_stats()[1].errors == 1);
  CHECK_FALSE(first.globe->refresh_layer(3).has_value());
}
