#include "globe/world_edit.h"

#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <thread>

#include <doctest/doctest.h>
#include <fmt/format.h>

using namespace tellurion;
using namespace tellurion::globe;

namespace {

constexpr const char* kWorld =
    "# Mine.\n"
    "\n"
    "[planet]\n"
    "name = \"Mars\"   # the red one\n"
    "\n"
    "# Heights from the laser.\n"
    "# They are good.\n"
    "[[layer]]\n"
    "group = \"height\"\n"
    "name = \"MOLA\"\n"
    "source = { type = \"gdal\", path = \"mola.tif\" }\n"
    "\n"
    "[[layer]]  # strips\n"
    "group = \"color\"\n"
    "name = \"Strips\"\n"
    "source = { type = \"catalogue\", files = [\n"
    "  \"a.tif\",  # the first\n"
    "  \"b/b.tif\",\n"
    "] }\n"
    "\n"
    "# Last.\n"
    "[[layer]]\n"
    "group = \"color\"\n"
    "name = \"Site\"\n"
    "[layer.source]\n"
    "path = \"/elsewhere/site.tif\"\n";

WorldText world_text(std::string text) {
  auto made = WorldText::parse(std::move(text), "/worlds", "mine.toml");
  REQUIRE_MESSAGE(made.has_value(), (made ? std::string() : made.error().message));
  return std::move(*made);
}

LayerSpec layer(const std::string& name, const std::string& path) {
  LayerSpec spec;
  spec.name = name;
  spec.source.path = path;
  return spec;
}

std::string with(std::string text, const std::string& old, const std::string& now) {
  const std::size_t at = text.find(old);
  REQUIRE(at != std::string::npos);
  return text.replace(at, old.size(), now);
}

std::string crlf(std::string text) {
  for (std::size_t i = 0; (i = text.find('\n', i)) != std::string::npos; i += 2) text.insert(i, 1, '\r');
  return text;
}

}  // namespace

TEST_CASE("a layer is written at the end, and all else stays") {
  WorldText text = world_text(kWorld);
  REQUIRE(text.add_layer(layer("New \"one\" \\ ü", "/worlds/new/ü.tif")).has_value());
  REQUIRE(text.text().starts_with(kWorld));
  CHECK(text.world().layers.size() == 4);
  CHECK(text.world().layers.back().name == "New \"one\" \\ ü");
  CHECK(text.world().layers.back().source.path == "/worlds/new/ü.tif");
  CHECK(text.text().substr(std::string(kWorld).size()).find("/worlds") == std::string::npos);  // a relative path
  REQUIRE(text.remove_layer(3).has_value());
  CHECK(text.text() == std::string(kWorld) + "\n");
}

TEST_CASE("a layer goes with the comments right above it, whichever it is") {
  WorldText first = world_text(kWorld);
  REQUIRE(first.remove_layer(0).has_value());
  CHECK(first.text() == with(kWorld, "# Heights from the laser.\n# They are good.\n[[layer]]\ngroup = \"height\"\nname = \"MOLA\"\nsource = { type = \"gdal\", path = \"mola.tif\" }\n\n", ""));
  WorldText last = world_text(kWorld);
  REQUIRE(last.remove_layer(2).has_value());
  CHECK(last.text() == std::string(kWorld).substr(0, std::string(kWorld).find("# Last.")));
  REQUIRE(last.remove_layer(1).has_value());
  REQUIRE(last.remove_layer(0).has_value());
  CHECK(last.text() == "# Mine.\n\n[planet]\nname = \"Mars\"   # the red one\n\n");
  REQUIRE(last.add_layer(layer("again", "/a.tif")).has_value());
  CHECK(last.world().layers.size() == 1);
}

TEST_CASE("files of a catalogue come as they stand there, and go") {
  WorldText text = world_text(kWorld);
  REQUIRE(text.add_files(1, {"/worlds/c.tif", "/worlds/a.tif", "https://host/d.tif"}).has_value());
  CHECK(text.text() == with(kWorld, "  \"b/b.tif\",\n", "  \"b/b.tif\",\n  \"c.tif\",\n  \"https://host/d.tif\",\n"));
  REQUIRE(text.remove_files(1, {"https://host/d.tif", "/worlds/c.tif"}).has_value());
  CHECK(text.text() == kWorld);
  REQUIRE(text.remove_files(1, {"/worlds/b/b.tif"}).has_value());
  CHECK(text.world().layers[1].source.catalogue.files == std::vector<std::string>{"/worlds/a.tif"});
  CHECK(text.remove_files(1, {"/worlds/a.tif"}).error().code == ErrorCode::invalid_argument);
  CHECK(text.remove_files(1, {"/worlds/none.tif"}).error().code == ErrorCode::not_found);
}

TEST_CASE("files in lists of every form") {
  const auto source_of = [](const std::string& source) { return "[[layer]]\nname = \"ü\"\ngroup = \"color\"\n" + source; };
  const struct {
    const char* before;
    const char* after;
  } kForms[] = {
      {"source = { type = \"catalogue\", files = [\"ü.tif\"] }\n", "source = { type = \"catalogue\", files = [\"ü.tif\", \"new.tif\"] }\n"},
      {"source = { files = ['a.tif'], type = \"catalogue\" } # é\n", "source = { files = ['a.tif', \"new.tif\"], type = \"catalogue\" } # é\n"},
      {"source = { type = \"catalogue\", path = \"d\", files = [] }\n", "source = { type = \"catalogue\", path = \"d\", files = [\"new.tif\"] }\n"},
      {"source = { type = \"catalogue\", path = \"d\" }\n", "source = { type = \"catalogue\", path = \"d\", files = [\"new.tif\"] }\n"},
      {"[layer.source]\ntype = \"catalogue\"\npath = \"d\"  # all\n", "[layer.source]\ntype = \"catalogue\"\npath = \"d\"\nfiles = [\"new.tif\"]  # all\n"},
  };
  for (const auto& form : kForms) {
    CAPTURE(form.before);
    for (const bool windows : {false, true}) {
      const auto lines = [&](const std::string& some) { return windows ? crlf(some) : some; };
      WorldText text = world_text(lines(source_of(form.before)));
      REQUIRE(text.add_files(0, {"/worlds/new.tif"}).has_value());
      CHECK(text.text() == lines(source_of(form.after)));
      REQUIRE(text.remove_files(0, {"/worlds/new.tif"}).has_value());
      CHECK(text.world().layers[0].source.catalogue.files == world_text(source_of(form.before)).world().layers[0].source.catalogue.files);
    }
  }
}

TEST_CASE("ends of lines and a missing one at the end of the file") {
  WorldText text = world_text(crlf(kWorld));
  REQUIRE(text.add_layer(layer("more", "/more.tif")).has_value());
  CHECK(text.text().starts_with(crlf(kWorld)));
  std::string bare = text.text();
  for (std::size_t i = 0; (i = bare.find("\r\n", i)) != std::string::npos;) bare.erase(i, 2);
  CHECK(bare.find('\n') == std::string::npos);
  std::string cut = kWorld;
  cut.pop_back();
  WorldText without = world_text(cut);
  REQUIRE(without.add_layer(layer("more", "/more.tif")).has_value());
  CHECK(without.text().starts_with(kWorld));
}

TEST_CASE("layers in one array are left alone") {
  const std::string one = "layer = [{ name = \"a\", group = \"color\", source = { path = \"a.tif\" } }]\n";
  WorldText text = world_text(one);
  CHECK(text.add_layer(layer("b", "/b.tif")).error().code == ErrorCode::unsupported);
  CHECK(text.remove_layer(0).error().code == ErrorCode::unsupported);
  CHECK(text.text() == one);
}

TEST_CASE("files are written whole, with their rights, through links, and by many at once") {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / fmt::format("tellurion-edit-{}", ::getpid());
  std::filesystem::create_directories(folder);
  const auto file = folder / "w.toml", link = folder / "link.toml";
  World moon;
  moon.planet = "Moon";
  moon.ellipsoid = geo::kMoon;
  REQUIRE(edit_world(file, moon, [](WorldText& text) { return text.add_layer(layer("0", "/0.tif")); }).has_value());
  CHECK(load_world(file)->planet == "Moon");
  REQUIRE(::chmod(file.c_str(), 0640) == 0);
  std::filesystem::create_symlink("w.toml", link);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 5; ++i) CHECK(edit_world(t % 2 == 0 ? file : link, {}, [&](WorldText& text) { return text.add_layer(layer(fmt::format("{}.{}", t, i), "/x.tif")); }).has_value());
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(load_world(file)->layers.size() == 21);
  CHECK(std::filesystem::is_symlink(link));
  struct stat about {};
  REQUIRE(::stat(file.c_str(), &about) == 0);
  CHECK((about.st_mode & 0777) == 0640);

  // What fails leaves the file, or that there is none.
  const Error refused{ErrorCode::invalid_argument, "no"};
  CHECK(!edit_world(folder / "new.toml", moon, [&](WorldText&) -> Result<void> { return refused; }));
  CHECK(!std::filesystem::exists(folder / "new.toml"));
  std::ofstream(folder / "bad.toml") << "[[layer\n";
  CHECK(edit_world(folder / "bad.toml", moon, [](WorldText&) { return Result<void>(); }).error().code == ErrorCode::corrupt);
  CHECK(edit_world(folder / "none" / "w.toml", moon, [](WorldText&) { return Result<void>(); }).error().code == ErrorCode::unavailable);
  std::filesystem::remove_all(folder);
}

TEST_CASE("set_settings: values change where they stand or come right under the layer's header") {
  WorldText world = world_text(with(kWorld, "name = \"Strips\"\n", "name = \"Strips\"\nopacity = 0.5  # so that one sees through\n"));
  LayerSettings settings = world.world().layers[1];
  settings.opacity = 0.25;
  settings.enabled = false;
  REQUIRE(world.set_settings(1, settings).has_value());
  CHECK(world.text() == with(with(kWorld, "name = \"Strips\"\n", "name = \"Strips\"\nopacity = 0.25  # so that one sees through\n"), "[[layer]]  # strips\n",
                             "[[layer]]  # strips\nenabled = false\n"));
  CHECK(world.world().layers[1] == settings);
  REQUIRE(world.set_settings(1, settings).has_value());
  CHECK(world.world().layers[1] == settings);
  settings.feather = 40.0;
  REQUIRE(world.set_settings(1, settings).has_value());
  CHECK(world.text().find("[[layer]]  # strips\nfeather = 40.0\nenabled = false\n") != std::string::npos);

  LayerSettings heights = world.world().layers[0];
  heights.adds = true;
  REQUIRE(world.set_settings(0, heights).has_value());
  CHECK(world.text().find("[[layer]]\nmode = \"add\"\ngroup = \"height\"\n") != std::string::npos);
}

TEST_CASE("set_settings, move_behind: layers in one array cannot be told apart by lines, and stay") {
  WorldText world = world_text("layer = [{ group = \"color\", source = { path = \"a.tif\" } }, { group = \"color\", source = { path = \"b.tif\" } }]\n");
  const std::string before = world.text();
  LayerSettings settings;
  settings.opacity = 0.5;
  CHECK(world.set_settings(0, settings).error().code == ErrorCode::unsupported);
  CHECK(world.move_behind(0, 1).error().code == ErrorCode::unsupported);
  CHECK(world.text() == before);
}

TEST_CASE("move_behind: a layer takes its comments along, up and down, and from the end of a file without a last line end") {
  WorldText world = world_text(kWorld);
  REQUIRE(world.move_behind(1, 2).has_value());
  CHECK(world.world().layers[1].name == "Site");
  CHECK(world.world().layers[2].name == "Strips");
  CHECK(world.text().find("# Last.\n[[layer]]\n") < world.text().find("[[layer]]  # strips\n"));
  REQUIRE(world.move_behind(2, 0).has_value());
  CHECK(world.world().layers[1].name == "Strips");
  CHECK(world.text().size() == std::string(kWorld).size());

  WorldText open_end = world_text(std::string(kWorld).substr(0, std::string(kWorld).size() - 1));
  REQUIRE(open_end.move_behind(2, 1).has_value());
  REQUIRE(open_end.move_behind(1, 2).has_value());
  CHECK(open_end.world().layers[1].name == "Site");
  REQUIRE(open_end.move_behind(2, 0).has_value());
  CHECK(open_end.world().layers[1].name == "Strips");
}
