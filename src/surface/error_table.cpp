#include "surface/error_table.h"

#include <cassert>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <span>
#include <system_error>
#include <utility>

namespace tellurion::surface {
namespace {

constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 30;  ///< of a file: enough for some 5 * 10^11 samples

/// Also tells another byte order and another version of the format apart.
constexpr std::uint64_t kMagic = 0x32'65'6c'62'61'74'6c'74;

std::uint64_t checksum_of(std::span<const char> bytes) {  // FNV-1a
  std::uint64_t sum = 0xcbf29ce484222325ull;
  for (const char byte : bytes) sum = (sum ^ static_cast<unsigned char>(byte)) * 0x100000001b3ull;
  return sum;
}

template <class T>
void append(std::vector<char>& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  const auto* first = reinterpret_cast<const char*>(&value);
  bytes.insert(bytes.end(), first, first + sizeof(T));
}

template <class T>
bool take(std::span<const char>& bytes, T& value) {
  if (bytes.size() < sizeof(T)) return false;
  std::memcpy(&value, bytes.data(), sizeof(T));
  bytes = bytes.subspan(sizeof(T));
  return true;
}

/// Whether children always come after their parents and none is shared, so that walking the tree ends.
bool is_sound(const std::vector<RecordTree::Node>& nodes) {
  std::size_t next = geo::kFaceCount;
  std::vector<bool> seen(nodes.size(), false);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::size_t children = nodes[i].children;
    if (children == 0) continue;
    if (children < geo::kFaceCount || children <= i || children + 4 > nodes.size() || seen[children]) return false;
    if ((children - geo::kFaceCount) % 4 != 0) return false;
    seen[children] = true;
    next += 4;
  }
  return next == nodes.size();
}

/// Whether the numbers can be those of a scan: a table beside a raster comes from anywhere.
bool is_sound(const TileRecord& record) {
  const HeightError& error = record.error;
  return std::isfinite(record.min_height) && std::isfinite(record.max_height) && record.min_height <= record.max_height && error.common >= 0.0f && error.common <= error.bound &&
         std::isfinite(error.bound) && record.whole <= 1;
}

}  // namespace

std::size_t RecordTree::add_children(std::size_t parent) {
  const std::size_t first = nodes_.size();
  nodes_[parent].children = static_cast<std::uint32_t>(first);
  nodes_.resize(first + 4);
  return first;
}

ErrorTable::ErrorTable(RecordTree tree) : tree_(std::move(tree)) { assert(tree_.size() >= geo::kFaceCount); }

ErrorTable::Found ErrorTable::find(const geo::TileKey& key) const {
  std::size_t node = key.face;
  int level = 0;
  while (level < key.level && tree_[node].children != 0) {
    ++level;
    node = tree_[node].children + static_cast<std::size_t>(geo::child_index(geo::ancestor(key, level)));
  }
  return {tree_[node].record, level == key.level};
}

Result<void> ErrorTable::save(const std::filesystem::path& path, std::string_view revision) const {
  std::vector<char> bytes;
  append(bytes, kMagic);
  append(bytes, static_cast<std::uint64_t>(revision.size()));
  bytes.insert(bytes.end(), revision.begin(), revision.end());
  append(bytes, static_cast<std::uint64_t>(tree_.size()));
  for (const RecordTree::Node& node : tree_.nodes()) append(bytes, node);
  append(bytes, checksum_of(bytes));

  const auto failure = [&](const char* what) {
    return Error{ErrorCode::unavailable, "cannot " + std::string(what) + " the error table " + path.string()};
  };
  std::error_code error;
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), error);
  std::filesystem::path part = path;
  part += "." + std::to_string(std::random_device{}()) + ".part";
  {
    std::ofstream file(part, std::ios::binary);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (!file) {
      std::filesystem::remove(part, error);
      return failure("write");
    }
  }
  std::filesystem::rename(part, path, error);
  if (error) {
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    return failure("put in place");
  }
  return {};
}

Result<ErrorTable> ErrorTable::load(const std::filesystem::path& path, std::string_view revision) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorCode::not_found, "no error table " + path.string()};
  std::error_code failure;
  if (std::filesystem::file_size(path, failure) > kMostBytes) return Error{ErrorCode::corrupt, "error table " + path.string() + ": too large"};
  const std::vector<char> content((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  return from_bytes(content, revision, path.string());
}

Result<ErrorTable> ErrorTable::from_bytes(std::span<const char> content, std::string_view revision, const std::string& name) {
  const auto corrupt = [&](const char* why) {
    return Error{ErrorCode::corrupt, "error table " + name + ": " + why + "; it will be made again"};
  };

  std::span<const char> rest(content);
  std::uint64_t magic = 0, length = 0, count = 0, checksum = 0;
  if (!take(rest, magic) || magic != kMagic || !take(rest, length) || length > rest.size()) return corrupt("no such file format");
  const std::string_view kept(rest.data(), length);
  if (kept != revision) return corrupt("made for other data");
  rest = rest.subspan(length);
  if (!take(rest, count) || count < geo::kFaceCount || count > rest.size() / sizeof(RecordTree::Node)) return corrupt("cut off");
  RecordTree tree(count);
  for (RecordTree::Node& node : tree.nodes()) {
    if (!take(rest, node)) return corrupt("cut off");
    if (!is_sound(node.record)) return corrupt("impossible heights");
  }
  const std::size_t summed = content.size() - rest.size();
  if (!take(rest, checksum) || !rest.empty()) return corrupt("wrong length");
  if (checksum != checksum_of({content.data(), summed})) return corrupt("wrong checksum");
  if (!is_sound(tree.nodes())) return corrupt("no tree");
  return ErrorTable(std::move(tree));
}

}  // namespace tellurion::surface
