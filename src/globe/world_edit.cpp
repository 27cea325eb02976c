#include "globe/world_edit.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <toml++/toml.h>

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

Result<void> WorldText::remove_layer(std::size_t layer) {
  const toml::table root = toml::parse(text_);
  if (are_inline(root)) return inline_layers(name_);
  const toml::array& layers = *root["layer"].as_array();
  const std::size_t header = line_start(text_, begin_of(text_, layers[layer]));
  std::size_t end = text_.size();
  const auto ends_before = [&](const toml::node& next) {
    const std::size_t start = line_start(text_, begin_of(text_, next));
    if (start > header) end = std::min(end, comments_above(text_, start));
  };
  for (const toml::node& other : layers) ends_before(other);
  if (const toml::node* planet = root.get("planet")) ends_before(*planet);
  World expected = world_;
  expected.layers.erase(expected.layers.begin() + static_cast<std::ptrdiff_t>(layer));
  const std::size_t start = comments_above(text_, header);
  return take(text_.substr(0, start) + text_.substr(end), expected);
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
    if (auto readable = load_world(target); !readable && !is_new) return readable.error();
    std::ifstream stream(target, std::ios::binary);
    std::string text(std::istreambuf_iterator<char>(stream), {});
    if (text.empty()) text = planet_to_toml(begin);
    auto world = WorldText::parse(std::move(text), target.parent_path(), file.string());
    if (!world) return world.error();
    if (Result<void> changed = change(*world); !changed) return changed;
    return write_whole(target, world->text());
  };
  Result<void> edited = edit();
  if (!edited && is_new) std::filesystem::remove(file, failure);
  return edited;
}

}  // namespace tellurion::globe
