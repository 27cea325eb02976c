#include "globe/world_edit.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "globe/globe.h"
#include "globe/world_text.h"

namespace tellurion::globe {
namespace {

/// A place in a text that toml++ counts in lines and code points, both from 1, as a count of bytes.
std::size_t offset_of(const std::string& text, const toml::source_position& at) {
  std::size_t offset = 0;
  for (toml::source_index line = 1; line < at.line; ++line) offset = text.find('\n', offset) + 1;
  const auto continues = [&](std::size_t i) { return i < text.size() && (static_cast<unsigned char>(text[i]) & 0xC0u) == 0x80u; };
  for (toml::source_index column = 1; column < at.column && offset < text.size(); ++column) {
    do ++offset;
    while (continues(offset));
  }
  return offset;
}

std::size_t begin_of(const std::string& text, const toml::node& node) { return offset_of(text, node.source().begin); }
std::size_t end_of(const std::string& text, const toml::node& node) { return offset_of(text, node.source().end); }

std::size_t line_start(const std::string& text, std::size_t offset) {
  return offset == 0 ? 0 : text.rfind('\n', offset - 1) + 1;  // npos + 1 is 0
}

/// Where the comment lines right above the line at `start` begin.
std::size_t comments_above(const std::string& text, std::size_t start) {
  while (start > 0) {
    const std::size_t above = line_start(text, start - 1);
    const std::size_t first = text.find_first_not_of(" \t", above);
    if (first >= start || text[first] != '#') break;
    start = above;
  }
  return start;
}

/// With the ends of lines that `text` has.
std::string with_line_ends_of(const std::string& text, std::string added) {
  if (text.find("\r\n") == std::string::npos) return added;
  for (std::size_t i = 0; (i = added.find('\n', i)) != std::string::npos; i += 2) added.insert(i, 1, '\r');
  return added;
}

const toml::table* source_of(const toml::table& root, std::size_t layer) { return root["layer"][layer]["source"].as_table(); }

bool are_inline(const toml::table& root) {
  const toml::array* layers = root["layer"].as_array();
  return layers && std::ranges::any_of(*layers, [](const toml::node& node) { return node.is_table() && node.as_table()->is_inline(); });
}

Error inline_layers(const std::string& name) {
  return {ErrorCode::unsupported, fmt::format("{}: its layers stand in one array: write each as [[layer]], then they can be changed", name)};
}

}  // namespace

WorldText::WorldText(std::string text, std::filesystem::path folder, std::string name, World world)
    : text_(std::move(text)), folder_(std::move(folder)), name_(std::move(name)), world_(std::move(world)) {}

Result<WorldText> WorldText::parse(std::string text, std::filesystem::path folder, std::string name) {
  auto world = parse_world(text, folder, name);
  if (!world) return world.error();
  world->file = folder / std::filesystem::path(name).filename();
  return WorldText(std::move(text), std::move(folder), std::move(name), std::move(*world));
}

Result<void> WorldText::take(std::string text, const World& expected) {
  auto changed = parse(std::move(text), folder_, name_);
  if (!changed || to_toml(changed->world_) != to_toml(expected))
    return {ErrorCode::unsupported, fmt::format("{}: is written in a way that this change does not fit into{}; nothing has been changed", name_, changed ? "" : " (" + changed.error().message + ")")};
  *this = std::move(*changed);
  return {};
}

Result<void> WorldText::add_layer(const LayerSpec& layer) {
  if (are_inline(toml::parse(text_))) return inline_layers(name_);
  World expected = world_;
  expected.layers.push_back(layer);
  std::string text = text_;
  if (!text.empty() && text.back() != '\n') text += with_line_ends_of(text, "\n");
  if (!text.empty()) text += with_line_ends_of(text, "\n");
  return take(text + with_line_ends_of(text, to_toml(layer, folder_)), expected);
}

/// Where a layer and the comment lines right above it begin and end.
std::pair<std::size_t, std::size_t> WorldText::lines_of(std::size_t layer) const {
  const toml::table root = toml::parse(text_);
  const toml::array& layers = *root["layer"].as_array();
  const std::size_t header = line_start(text_, begin_of(text_, layers[layer]));
  std::size_t end = text_.size();
  const auto ends_before = [&](const toml::node& next) {
    const std::size_t start = line_start(text_, begin_of(text_, next));
    if (start > header) end = std::min(end, comments_above(text_, start));
  };
  for (const toml::node& other : layers) ends_before(other);
  if (const toml::node* planet = root.get("planet")) ends_before(*planet);
  return {comments_above(text_, header), end};
}

Result<void> WorldText::remove_layer(std::size_t layer) {
  if (are_inline(toml::parse(text_))) return inline_layers(name_);
  World expected = world_;
  expected.layers.erase(expected.layers.begin() + static_cast<std::ptrdiff_t>(layer));
  const auto [start, end] = lines_of(layer);
  return take(text_.substr(0, start) + text_.substr(end), expected);
}

Result<void> WorldText::move_behind(std::size_t layer, std::size_t other) {
  if (are_inline(toml::parse(text_))) return inline_layers(name_);
  if (layer == other) return {};
  World expected = world_;
  LayerSpec moved = expected.layers[layer];
  expected.layers.insert(expected.layers.begin() + static_cast<std::ptrdiff_t>(other) + 1, std::move(moved));
  expected.layers.erase(expected.layers.begin() + static_cast<std::ptrdiff_t>(layer < other ? layer : layer + 1));

  const auto [start, end] = lines_of(layer);
  const std::size_t place = lines_of(other).second;
  std::string lines = text_.substr(start, end - start);
  if (lines.back() != '\n') lines += with_line_ends_of(text_, "\n");  // it was the last one
  std::string text = text_;
  if (place > start) {
    if (text.back() != '\n' && place == text.size()) lines.insert(0, with_line_ends_of(text_, "\n"));
    text.insert(place, lines).erase(start, end - start);
  } else {
    text.erase(start, end - start).insert(place, lines);
  }
  return take(std::move(text), expected);
}

Result<void> WorldText::set_settings(std::size_t layer, const LayerSettings& settings) {
  World expected = world_;
  LayerSettings& now = expected.layers[layer];
  const auto change = [&](std::string& text, const char* key, const std::string& value) {
    const toml::table root = toml::parse(text);
    const toml::table& table = *root["layer"][layer].as_table();
    if (const toml::node* node = table.get(key)) {
      const std::size_t start = begin_of(text, *node);
      text.replace(start, end_of(text, *node) - start, value);
      return;
    }
    const std::size_t header = begin_of(text, table);
    const std::string end = with_line_ends_of(text, "\n");
    std::size_t line_end = text.find('\n', header);
    if (line_end == std::string::npos) {
      text += end;
      line_end = text.size() - 1;
    }
    text.insert(line_end + 1, fmt::format("{} = {}{}", key, value, end));
  };
  if (settings == now) return {};
  if (are_inline(toml::parse(text_))) return inline_layers(name_);
  std::string text = text_;
  if (settings.opacity != now.opacity) change(text, "opacity", to_toml(settings.opacity));
  if (settings.gamma != now.gamma) change(text, "gamma", to_toml(settings.gamma));
  if (settings.multiplier != now.multiplier) change(text, "multiplier", to_toml(settings.multiplier));
  if (settings.feather != now.feather) change(text, "feather", to_toml(settings.feather));
  if (settings.enabled != now.enabled) change(text, "enabled", settings.enabled ? "true" : "false");
  if (settings.adds != now.adds) change(text, "mode", settings.adds ? "\"add\"" : "\"replace\"");
  now = settings;
  return take(std::move(text), expected);
}

Result<void> WorldText::add_files(std::size_t layer, const std::vector<std::string>& files) {
  World expected = world_;
  std::vector<std::string>& listed = expected.layers[layer].source.catalogue.files;
  std::vector<std::string> added;
  for (const std::string& file : files) {
    if (std::ranges::find(listed, file) != listed.end()) continue;
    listed.push_back(file);
    added.push_back(to_toml(name_in(file, folder_)));
  }
  if (added.empty()) return {};

  const toml::table root = toml::parse(text_);
  const toml::table* source = source_of(root, layer);
  std::string text;
  std::size_t place = 0;
  if (const toml::array* list = source->get_as<toml::array>("files")) {
    // Behind the last one, as that stands: on a line of its own, or not.
    const bool is_empty = list->empty();
    const std::size_t last = is_empty ? begin_of(text_, *list) : begin_of(text_, list->back());
    const std::size_t line = line_start(text_, last);
    const std::size_t first = text_.find_first_not_of(" \t", line);
    const std::string gap = !is_empty && first == last ? with_line_ends_of(text_, "\n") + text_.substr(line, first - line) : " ";
    place = is_empty ? last + 1 : end_of(text_, list->back());
    text = is_empty ? fmt::format("{}", fmt::join(added, ", ")) : "," + gap + fmt::format("{}", fmt::join(added, "," + gap));
  } else {
    for (const auto& [key, node] : *source) place = std::max(place, end_of(text_, node));
    text = fmt::format("{}files = [{}]", source->is_inline() ? ", " : with_line_ends_of(text_, "\n"), fmt::join(added, ", "));
  }
  return take(std::string(text_).insert(place, text), expected);
}

Result<void> WorldText::remove_files(std::size_t layer, const std::vector<std::string>& files) {
  std::string text = text_;
  World expected = world_;
  std::vector<std::string>& listed = expected.layers[layer].source.catalogue.files;
  for (const std::string& file : files) {
    const auto found = std::ranges::find(listed, file);
    if (found == listed.end()) return {ErrorCode::not_found, fmt::format("{}: \"{}\" does not list {}", name_, world_.layers[layer].name, file)};
    const toml::table root = toml::parse(text);
    const toml::array& list = *source_of(root, layer)->get_as<toml::array>("files");
    const auto i = static_cast<std::size_t>(found - listed.begin());
    // Up to the next one; the last one from the end of the one before.
    std::size_t start = begin_of(text, list[i]), end = end_of(text, list[i]);
    if (i + 1 < list.size()) {
      end = begin_of(text, list[i + 1]);
    } else if (i > 0) {
      start = end_of(text, list[i - 1]);
    } else if (const std::size_t next = text.find_first_not_of(" \t\r\n", end); text[next] == ',') {
      end = next + 1;
    }
    text.erase(start, end - start);
    listed.erase(found);
  }
  if (listed.empty() && world_.layers[layer].source.path.empty())
    return {ErrorCode::invalid_argument, fmt::format("{}: nothing would be left of \"{}\": remove the layer", name_, world_.layers[layer].name)};
  return take(std::move(text), expected);
}

// --- Files -----------------------------------------------------------------------------------------------------------

namespace {

/// A file that this process alone may change.
class LockedFile {
 public:
  ~LockedFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  LockedFile() = default;
  LockedFile(const LockedFile&) = delete;
  LockedFile& operator=(const LockedFile&) = delete;

  /// Makes the file if it is not there.
  Result<void> lock(const std::filesystem::path& file) {
    for (;;) {
      descriptor_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
      if (descriptor_ < 0 || ::flock(descriptor_, LOCK_EX) != 0)
        return {ErrorCode::unavailable, fmt::format("{}: cannot be written: {}", file.string(), std::strerror(errno))};
      struct stat locked {};
      struct stat named {};
      if (::fstat(descriptor_, &locked) == 0 && ::stat(file.c_str(), &named) == 0 && locked.st_ino == named.st_ino && locked.st_dev == named.st_dev) return {};
      ::close(descriptor_);  // another process has put a new file there
      descriptor_ = -1;
    }
  }

 private:
  int descriptor_ = -1;
};

}  // namespace

Result<void> edit_world(const std::filesystem::path& file, const World& begin, const std::function<Result<void>(WorldText&)>& change) {
  std::error_code failure;
  const bool is_new = !std::filesystem::exists(file, failure);
  LockedFile lock;
  if (Result<void> locked = lock.lock(file); !locked) return locked;
  const auto edit = [&]() -> Result<void> {
    const auto target = std::filesystem::canonical(file, failure);  // a link stays a link
    auto text = read_whole(target);
    if (!text) return text.error();
    auto world = WorldText::parse(text->empty() ? planet_to_toml(begin) : std::move(*text), target.parent_path(), file.string());
    if (!world) return world.error();
    if (Result<void> changed = change(*world); !changed) return changed;
    return write_whole(target, world->text());
  };
  Result<void> edited = edit();
  if (!edited && is_new) std::filesystem::remove(file, failure);
  return edited;
}

namespace {

/// The layer with the settings that a world file need not name.
std::string without_settings(LayerSpec layer) {
  static_cast<LayerSettings&>(layer) = {};
  return to_toml(layer, {});
}

/// Where each of `layers` stands in the file, which may have been changed since it was opened; nothing for those that are not in it.
std::map<std::size_t, std::size_t> places_of(const std::vector<std::size_t>& layers, const Globe& globe, const World& written) {
  std::map<std::size_t, std::size_t> places;
  std::vector<bool> is_taken(written.layers.size());
  for (const std::size_t layer : layers) {
    for (std::size_t i = 0; i < written.layers.size(); ++i) {
      if (is_taken[i] || without_settings(written.layers[i]) != without_settings(globe.layer(layer).spec)) continue;
      is_taken[i] = true;
      places.emplace(layer, i);
      break;
    }
  }
  return places;
}

LayerSpec with_settings(const Globe& globe, std::size_t layer) {
  LayerSpec spec = globe.layer(layer).spec;
  static_cast<LayerSettings&>(spec) = globe.layer_settings(layer);
  return spec;
}

/// The layers that a file can hold, the lowest first: what a program draws itself is in no file.
std::vector<std::size_t> layers_to_keep(const Globe& globe) {
  std::vector<std::size_t> layers = globe.layer_order();
  std::erase_if(layers, [&](std::size_t i) { return globe.layer(i).spec.source.raster != nullptr; });
  return layers;
}

Result<void> put_in(const Globe& globe, KeptLayers& kept, WorldText& world) {
  const std::vector<std::size_t> order = layers_to_keep(globe);
  // Those that are in the file, and behind them those that were.
  std::vector<std::size_t> known;
  std::ranges::copy_if(order, std::back_inserter(known), [&](std::size_t i) { return kept.layers.contains(i); });
  std::ranges::sort(known);
  const std::size_t present = known.size();
  std::ranges::copy_if(kept.layers, std::back_inserter(known), [&](std::size_t i) { return std::ranges::find(order, i) == order.end(); });
  std::map<std::size_t, std::size_t> place = places_of(known, globe, world.world());
  for (std::size_t n = 0; n < present; ++n) {
    if (!place.contains(known[n]))
      return {ErrorCode::unsupported, fmt::format("{}: has no layer \"{}\" any more as it was opened; nothing has been saved", kept.file.string(), globe.layer(known[n]).spec.name)};
  }
  for (std::size_t n = present; n < known.size(); ++n) {
    const auto found = place.find(known[n]);
    if (found == place.end()) continue;  // somebody else has removed it too
    const std::size_t gone = found->second;
    if (Result<void> removed = world.remove_layer(gone); !removed) return removed;
    place.erase(found);
    for (auto& [layer, other] : place) other -= other > gone ? 1 : 0;
  }
  for (const std::size_t i : order) {
    if (place.contains(i)) {
      if (Result<void> set = world.set_settings(place[i], globe.layer_settings(i)); !set) return set;
    } else {
      if (Result<void> added = world.add_layer(with_settings(globe, i)); !added) return added;
      place[i] = world.world().layers.size() - 1;
    }
  }
  // Each follows the one below it in its group.
  for (std::size_t n = 1; n < order.size(); ++n) {
    const std::size_t above = place[order[n]], below = place[order[n - 1]];
    if (globe.layer(order[n]).spec.group != globe.layer(order[n - 1]).spec.group || above > below) continue;
    if (Result<void> moved = world.move_behind(above, below); !moved) return moved;
    for (auto& [layer, other] : place) {
      if (other == above) other = below;
      else if (other > above && other <= below) --other;
    }
  }
  kept.layers = {order.begin(), order.end()};
  return {};
}

bool is_default(const std::filesystem::path& file) {
  const auto folder = default_data_folder();
  std::error_code failure;
  return folder && std::filesystem::equivalent(*folder / "world.toml", file, failure);
}

/// A new file of all layers.
Result<void> put_in_new(const Globe& globe, KeptLayers& kept, const std::filesystem::path& folder) {
  const std::vector<std::size_t> order = layers_to_keep(globe);
  World world = globe.world();
  world.layers.clear();
  for (const std::size_t i : order) world.layers.push_back(with_settings(globe, i));
  std::error_code failure;
  const std::filesystem::path whole_folder = std::filesystem::absolute(folder.empty() ? "." : folder, failure).lexically_normal();
  std::filesystem::path made = whole_folder / "world.toml";
  for (int n = 2; std::filesystem::exists(made, failure); ++n) made = whole_folder / fmt::format("world-{}.toml", n);
  if (Result<void> written = save_world(world, made); !written) return written;
  kept = {made, {order.begin(), order.end()}};
  return {};
}

}  // namespace

Result<std::filesystem::path> save_layers(Globe& globe, const std::filesystem::path& folder) {
  std::filesystem::path file;
  const Result<void> saved = globe.change_kept_layers([&](KeptLayers& kept) -> Result<void> {
    Result<void> written = kept.file.empty() || is_default(kept.file)
                               ? put_in_new(globe, kept, folder)
                               : edit_world(kept.file, globe.world(), [&](WorldText& world) { return put_in(globe, kept, world); });
    file = kept.file;
    return written;
  });
  if (!saved) return saved.error();
  return file;
}

}  // namespace tellurion::globe
