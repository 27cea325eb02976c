#include "prepare/scan_file.h"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <type_traits>

#include <fmt/format.h>

#include "base/hash.h"
#include "prepare/write_whole.h"

namespace tellurion::prepare {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMagic = 0x31'6e'61'63'73'6c'74'74;  ///< also tells another byte order apart

template <class T>
void put(std::string& bytes, const T* values, std::size_t count) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

template <class T>
bool take(std::string_view& bytes, T* values, std::size_t count) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (bytes.size() / sizeof(T) < count) return false;
  std::memcpy(values, bytes.data(), count * sizeof(T));
  bytes.remove_prefix(count * sizeof(T));
  return true;
}

struct Head {
  std::uint64_t magic = kMagic;
  std::uint64_t root = 0;
  std::uint64_t nodes = 0;
  std::uint64_t above = 0;
};

std::uint64_t number_of(const geo::TileKey& key) { return fnv1a(geo::to_string(key)); }

}  // namespace

Result<void> save_scan(const surface::PartScan& scan, const fs::path& file) {
  const Head head{kMagic, number_of(scan.root), scan.tree.size(), scan.above.size()};
  std::string bytes;
  put(bytes, &head, 1);
  put(bytes, scan.tree.nodes().data(), scan.tree.size());
  put(bytes, scan.above.data(), scan.above.size());
  const std::uint64_t sum = fnv1a(bytes);
  put(bytes, &sum, 1);
  return write_whole(file, bytes);
}

Result<surface::PartScan> load_scan(const fs::path& file, const geo::TileKey& root) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return {ErrorCode::not_found, fmt::format("{}: no such file", file.string())};
  const std::string content{std::istreambuf_iterator<char>(stream), {}};
  const Error damaged{ErrorCode::corrupt, fmt::format("{}: is damaged", file.string())};
  std::string_view rest = content;
  Head head;
  if (!take(rest, &head, 1) || head.magic != kMagic || head.root != number_of(root) || head.nodes == 0 || head.above != root.level) return damaged;
  if (head.nodes > rest.size() / sizeof(surface::RecordTree::Node)) return damaged;
  surface::PartScan scan{root, surface::RecordTree(head.nodes), std::vector<surface::OpenRecord>(head.above)};
  if (!take(rest, scan.tree.nodes().data(), head.nodes) || !take(rest, scan.above.data(), head.above)) return damaged;
  std::uint64_t sum = 0;
  const std::size_t summed = content.size() - rest.size();
  if (!take(rest, &sum, 1) || !rest.empty() || sum != fnv1a(std::string_view(content).substr(0, summed))) return damaged;
  return scan;
}

}  // namespace tellurion::prepare
