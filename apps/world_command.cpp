// tellurion world: the layers of a world file.
#include "commands.h"

#include <algorithm>
#include <charconv>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "options.h"

namespace tellurion::apps {
namespace {

struct WorldOptions {
  std::string world;
  std::vector<std::string> words;   ///< data, or layers
  std::string group, name, to;
  bool is_list = false;
  std::string vertical;
  std::optional<double> opacity, feather, no_data;
};

std::string absolute(const std::string& path) {
  std::error_code failure;
  return path.starts_with("http") ? path : std::filesystem::absolute(path, failure).lexically_normal().string();
}

std::string what_it_shows(const globe::LayerSpec& layer) {
  const auto& source = layer.source;
  const std::string where = globe::data_name(source);
  if (source.type != "catalogue") return fmt::format("{} {}", source.type, where);
  const std::size_t files = source.catalogue.files.size();
  if (where.empty()) return fmt::format("catalogue of {} files", files);
  return fmt::format("catalogue {}{}", where, files > 0 ? fmt::format(" and {} files", files) : "");
}

int list(const WorldOptions& options) {
  const auto world = globe::resolve_world(options.world);
  if (!world) return report(world.error());
  fmt::print("{}, {:.0f} x {:.0f} m; in each group the later lie over the earlier\n", world->planet, world->ellipsoid.a(), world->ellipsoid.b());
  for (std::size_t i = 0; i < world->layers.size(); ++i) {
    const globe::LayerSpec& layer = world->layers[i];
    fmt::print("{:>3}  {:<18} {}{}{}{}\n     {}\n", i + 1, globe::name_of(layer.group), layer.name, layer.enabled ? "" : ", off",
               layer.opacity < 1.0 ? fmt::format(", opacity {:g}", layer.opacity) : "", layer.feather > 0.0 ? fmt::format(", feather {:g}", layer.feather) : "", what_it_shows(layer));
  }
  return kDone;
}

/// The layer of this number or name. Errors: not_found, invalid_argument (several have the name).
Result<std::size_t> find_layer(const globe::World& world, const std::string& word) {
  std::size_t number = 0;
  const auto [end, failed] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (failed == std::errc() && end == word.data() + word.size() && number >= 1 && number <= world.layers.size()) return number - 1;
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < world.layers.size(); ++i) {
    if (world.layers[i].name == word) found.push_back(i);
  }
  if (found.size() == 1) return found.front();
  if (found.empty()) return Error{ErrorCode::not_found, fmt::format("no layer is called \"{}\", nor has it that number; `tellurion world list` tells them", word)};
  return Error{ErrorCode::invalid_argument, fmt::format("several layers are called \"{}\": give the number of one, {} for example", word, found.front() + 1)};
}

Result<void> add_layers(globe::WorldText& text, const std::vector<globe::World>& data, const WorldOptions& options) {
  for (const globe::World& one : data) {
    auto found = globe::layer_for(text.world(), one);
    if (!found) return found.error();
    globe::LayerSpec layer = std::move(*found);
    if (!options.name.empty()) layer.name = options.name;
    if (const auto group = globe::group_by_name(options.group)) layer.group = *group;
    if (options.opacity) layer.opacity = *options.opacity;
    if (options.feather) layer.feather = *options.feather;
    if (const auto fine = globe::check(layer, layer.group); !fine) return {fine.error().code, fmt::format("{}: {}", layer.name, fine.error().message)};
    if (!options.vertical.empty()) layer.source.vertical = options.vertical;
    if (options.no_data) {
      const std::string& type = layer.source.type;
      if (type != "gdal" && type != "cog" && type != "catalogue") return {ErrorCode::invalid_argument, fmt::format("{}: --no-data is of rasters, not of sources of type \"{}\"", layer.name, type)};
      layer.source.no_data = options.no_data;
    }
    if (std::ranges::find(text.world().layers, layer.name, &globe::LayerSpec::name) != text.world().layers.end())
      return {ErrorCode::invalid_argument, fmt::format("{} has a layer called \"{}\": choose another --name", options.world, layer.name)};
    if (Result<void> added = text.add_layer(layer); !added) return added;
  }
  return {};
}

Result<void> add_to_catalogue(globe::WorldText& text, const WorldOptions& options) {
  const auto layer = find_layer(text.world(), options.to);
  if (!layer) return layer.error();
  if (text.world().layers[*layer].source.type != "catalogue")
    return {ErrorCode::invalid_argument, fmt::format("\"{}\" is no catalogue: without --to, each raster becomes a layer", text.world().layers[*layer].name)};
  std::vector<std::string> files;
  std::ranges::transform(options.words, std::back_inserter(files), absolute);
  return text.add_files(*layer, files);
}

int add(const WorldOptions& options) {
  // What cannot be read is told before anything is written.
  std::vector<globe::World> data;
  for (const std::string& word : options.words) {
    auto one = globe::world_of_data(word, options.is_list);
    if (!one) return report(one.error());
    data.push_back(std::move(*one));
  }
  const auto change = [&](globe::WorldText& text) { return options.to.empty() ? add_layers(text, data, options) : add_to_catalogue(text, options); };
  if (const auto edited = globe::edit_world(options.world, data.front(), change); !edited) return report(edited.error());
  return kDone;
}

Result<void> remove_one(globe::WorldText& text, const std::string& word) {
  const globe::World& world = text.world();
  if (const auto layer = find_layer(world, word)) return text.remove_layer(*layer);
  else if (layer.error().code != ErrorCode::not_found) return layer.error();
  for (std::size_t i = 0; i < world.layers.size(); ++i) {
    const auto& files = world.layers[i].source.catalogue.files;
    if (std::ranges::find(files, absolute(word)) != files.end()) return text.remove_files(i, {absolute(word)});
  }
  return {ErrorCode::not_found, fmt::format("\"{}\" is neither the name or number of a layer nor a file that a catalogue lists; `tellurion world list` tells the layers", word)};
}

int remove(const WorldOptions& options) {
  const auto change = [&](globe::WorldText& text) -> Result<void> {
    // Numbers are those of the file as it is: from the last to the first.
    std::vector<std::string> words = options.words;
    std::ranges::sort(words, std::greater(), [&](const std::string& word) {
      const auto layer = find_layer(text.world(), word);
      return layer ? *layer + 1 : 0;
    });
    for (const std::string& word : words) {
      if (Result<void> removed = remove_one(text, word); !removed) return removed;
    }
    return {};
  };
  std::error_code failure;
  if (!std::filesystem::exists(options.world, failure)) return report({ErrorCode::not_found, fmt::format("{}: there is no such world file", options.world)});
  if (const auto edited = globe::edit_world(options.world, {}, change); !edited) return report(edited.error());
  return kDone;
}

}  // namespace

void add_world_files(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("world", "the layers of a world file: what else stands in it is left as it is");
  command->require_subcommand(1);
  auto options = std::make_shared<WorldOptions>();
  const auto sub = [&](const char* name, const char* help, int (*work)(const WorldOptions&)) {
    CLI::App* made = command->add_subcommand(name, help);
    made->callback([options, work, &run] { run = [options, work] { return work(*options); }; });
    return made;
  };
  sub("list", "number, group, name and data of every layer", list)->add_option("WORLD", options->world, "a world file or whatever view takes (default: the embedded Earth)")->type_name("");

  CLI::App* adding = sub("add", "put data on top, each as a layer; folders as a catalogue of all their rasters", add);
  adding->add_option("WORLD", options->world, "a world file; begun if it is not there")->required()->type_name("");
  adding->add_option("DATA", options->words, "rasters, folders, archives of tiles, URLs")->required()->type_name("");
  CLI::Option* group = adding->add_option("--group", options->group, "of the layer (default: by what the data look like)")->type_name("GROUP");
  group->check([](const std::string& word) { return globe::group_by_name(word) ? std::string() : fmt::format("no group is called \"{}\": see docs/world-file.md", word); });
  CLI::Option* name = adding->add_option("--name", options->name, "of the layer (default: the file's)");
  CLI::Option* opacity = adding->add_option("--opacity", options->opacity, "of the layer, 0 to 1")->check(CLI::Range(0.0, 1.0));
  CLI::Option* feather = adding->add_option("--feather", options->feather, "pixels of the data over which it fades in from its edges (0)")->check(CLI::Range(0.0, globe::kMostFeather))->type_name("PIXELS");
  CLI::Option* vertical = adding->add_option("--vertical", options->vertical, "what heights are above: ellipsoid, sphere, egm96 or a vertical CRS (default: what the data say)")->type_name("DATUM");
  CLI::Option* no_data = adding->add_option("--no-data", options->no_data, "the value of rasters that means nothing is there (default: their own)")->type_name("VALUE");
  CLI::Option* is_list = adding->add_flag("--list", options->is_list, "the data are lists of rasters (a VRT, an index of gdaltindex, STAC items): a catalogue of each");
  CLI::Option* to = adding->add_option("--to", options->to, "put the rasters into this catalogue (name or number) instead")->type_name("LAYER");
  for (CLI::Option* other : {group, name, opacity, feather, vertical, no_data, is_list}) to->excludes(other);

  CLI::App* removing = sub("remove", "take layers out, or files that a catalogue lists", remove);
  removing->add_option("WORLD", options->world, "a world file")->required()->type_name("");
  removing->add_option("LAYER", options->words, "names or numbers of layers, or files")->required()->type_name("");
}

}  // namespace tellurion::apps
