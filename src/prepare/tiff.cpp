#include "prepare/tiff.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace tellurion::prepare {
namespace {

constexpr std::uint16_t kLong = 4, kLong8 = 16;
constexpr std::size_t kMostValueBytes = std::size_t{1} << 26;

/// What GDAL looks for to know that it may read blocks without looking up their lengths.
constexpr std::string_view kGhost =
    "GDAL_STRUCTURAL_METADATA_SIZE=000140 bytes\n"
    "LAYOUT=IFDS_BEFORE_DATA\nBLOCK_ORDER=ROW_MAJOR\nBLOCK_LEADER=SIZE_AS_UINT4\nBLOCK_TRAILER=LAST_4_BYTES_REPEATED\n"
    "KNOWN_INCOMPATIBLE_EDITION=NO\n ";
static_assert(kGhost.size() == 43 + 140);

std::size_t bytes_of_type(std::uint16_t type) {
  constexpr std::array<std::size_t, 19> kBytes{0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8};
  return type < kBytes.size() ? kBytes[type] : 0;
}

void append(std::vector<std::byte>& bytes, std::uint64_t number, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) bytes.push_back(static_cast<std::byte>(number >> (8 * i) & 0xff));
}

/// Reads little-endian numbers; what lies outside is 0 and is remembered.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::uint64_t number(std::uint64_t at, std::size_t count) {
    if (at > bytes_.size() || bytes_.size() - at < count) {
      good_ = false;
      return 0;
    }
    std::uint64_t result = 0;
    for (std::size_t i = 0; i < count; ++i) result |= std::to_integer<std::uint64_t>(bytes_[at + i]) << (8 * i);
    return result;
  }
  bool good() const { return good_; }

 private:
  std::span<const std::byte> bytes_;
  bool good_ = true;
};

/// Writes directories; `big` and where the data begin change the lengths of nothing but the fields of offsets.
std::vector<std::byte> write_head(const std::vector<CogLevel>& levels, const std::vector<std::vector<std::uint64_t>>& offsets, bool big) {
  const std::size_t word = big ? 8 : 4, entry = big ? 20 : 12, count_bytes = big ? 8 : 2;
  std::vector<std::byte> bytes{std::byte{'I'}, std::byte{'I'}};
  append(bytes, big ? 43 : 42, 2);
  if (big) append(bytes, 8, 4);  // the length of offsets, and two bytes of zero
  append(bytes, bytes.size() + word + kGhost.size() + (kGhost.size() + bytes.size() + word) % 2, word);
  for (const char c : kGhost) bytes.push_back(static_cast<std::byte>(c));
  if (bytes.size() % 2 != 0) bytes.push_back(std::byte{0});
  for (std::size_t i = 0; i < levels.size(); ++i) {
    TiffDirectory directory = levels[i].directory;
    TiffField where{kTileOffsetsTag, big ? kLong8 : kLong, offsets[i].size(), {}}, lengths{kTileByteCountsTag, kLong, offsets[i].size(), {}};
    for (const std::uint64_t offset : offsets[i]) append(where.value, offset, word);
    for (const std::uint32_t length : levels[i].block_bytes) append(lengths.value, length, 4);
    set_field(directory, std::move(where));
    set_field(directory, std::move(lengths));

    std::uint64_t values_at = bytes.size() + count_bytes + directory.size() * entry + word;
    std::vector<std::byte> values;
    append(bytes, directory.size(), count_bytes);
    for (const TiffField& field : directory) {
      append(bytes, field.tag, 2);
      append(bytes, field.type, 2);
      append(bytes, field.count, word);
      if (field.value.size() <= word) {
        bytes.insert(bytes.end(), field.value.begin(), field.value.end());
        bytes.resize(bytes.size() + word - field.value.size());
      } else {
        append(bytes, values_at + values.size(), word);
        values.insert(values.end(), field.value.begin(), field.value.end());
        values.resize((values.size() + 7) / 8 * 8);
      }
    }
    const std::uint64_t end = values_at + values.size();
    append(bytes, i + 1 < levels.size() ? end + end % 2 : 0, word);
    bytes.insert(bytes.end(), values.begin(), values.end());
    if (bytes.size() % 2 != 0) bytes.push_back(std::byte{0});
  }
  return bytes;
}

}  // namespace

TiffField long_field(std::uint16_t tag, std::uint32_t value) {
  TiffField field{tag, kLong, 1, {}};
  append(field.value, value, 4);
  return field;
}

const TiffField* find_field(const TiffDirectory& directory, std::uint16_t tag) {
  const auto found = std::find_if(directory.begin(), directory.end(), [tag](const TiffField& field) { return field.tag == tag; });
  return found != directory.end() ? &*found : nullptr;
}

void set_field(TiffDirectory& directory, TiffField field) {
  const auto at = std::lower_bound(directory.begin(), directory.end(), field.tag, [](const TiffField& one, std::uint16_t tag) { return one.tag < tag; });
  if (at != directory.end() && at->tag == field.tag) *at = std::move(field);
  else directory.insert(at, std::move(field));
}

std::vector<std::uint64_t> numbers_of(const TiffField& field) {
  const std::size_t bytes = bytes_of_type(field.type);
  Reader reader(field.value);
  std::vector<std::uint64_t> numbers;
  for (std::size_t at = 0; bytes > 0 && at + bytes <= field.value.size(); at += bytes) numbers.push_back(reader.number(at, bytes));
  return numbers;
}

Result<TiffDirectory> read_directory(std::span<const std::byte> file) {
  Reader reader(file);
  if (reader.number(0, 2) != 0x4949 || reader.number(2, 2) != 42) return {ErrorCode::unsupported, "no little-endian TIFF"};
  const std::uint64_t at = reader.number(4, 4), count = reader.number(at, 2);
  TiffDirectory directory;
  for (std::uint64_t i = 0; i < count && reader.good(); ++i) {
    const std::uint64_t entry = at + 2 + 12 * i;
    TiffField field{static_cast<std::uint16_t>(reader.number(entry, 2)), static_cast<std::uint16_t>(reader.number(entry + 2, 2)), reader.number(entry + 4, 4), {}};
    const std::uint64_t bytes = field.count * bytes_of_type(field.type);
    const std::uint64_t value = bytes <= 4 ? entry + 8 : reader.number(entry + 8, 4);
    if (bytes > kMostValueBytes || value > file.size() || file.size() - value < bytes) return {ErrorCode::corrupt, "a TIFF directory reaches beyond the file"};
    field.value.assign(file.begin() + static_cast<std::ptrdiff_t>(value), file.begin() + static_cast<std::ptrdiff_t>(value + bytes));
    directory.push_back(std::move(field));
  }
  if (!reader.good()) return {ErrorCode::corrupt, "a TIFF directory reaches beyond the file"};
  std::stable_sort(directory.begin(), directory.end(), [](const TiffField& a, const TiffField& b) { return a.tag < b.tag; });
  return directory;
}

CogHead lay_out_cog(const std::vector<CogLevel>& levels) {
  std::uint64_t data_bytes = 0;
  std::vector<std::vector<std::uint64_t>> offsets;
  for (const CogLevel& level : levels) {
    offsets.emplace_back(level.block_bytes.size());
    for (const std::uint32_t length : level.block_bytes) data_bytes += length > 0 ? length + kBlockFrameBytes : 0;
  }
  constexpr std::uint64_t kMostClassic = 0xffff0000;
  bool big = false;
  std::uint64_t head_bytes = write_head(levels, offsets, big).size();
  if (head_bytes + data_bytes > kMostClassic) {
    big = true;
    head_bytes = write_head(levels, offsets, big).size();
  }
  std::uint64_t at = head_bytes;
  for (std::size_t i = levels.size(); i-- > 0;) {
    for (std::size_t block = 0; block < offsets[i].size(); ++block) {
      const std::uint32_t length = levels[i].block_bytes[block];
      if (length == 0) continue;
      offsets[i][block] = at + 4;
      at += length + kBlockFrameBytes;
    }
  }
  return {write_head(levels, offsets, big), at};
}

}  // namespace tellurion::prepare
