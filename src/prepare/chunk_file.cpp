#include "prepare/chunk_file.h"

#include <bit>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "base/hash.h"

namespace tellurion::prepare {
namespace {

static_assert(std::endian::native == std::endian::little, "chunks are written as memory holds them");

constexpr char kMagic[8] = {'T', 'L', 'C', 'H', 'U', 'N', 'K', '1'};

struct Footer {
  std::uint64_t index_offset = 0;
  std::uint64_t index_hash = 0;
  char magic[8]{};
};

template <class T>
void put(std::string& text, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  text.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class T>
bool take(std::string_view& text, T& value) {
  if (text.size() < sizeof value) return false;
  std::memcpy(&value, text.data(), sizeof value);
  text.remove_prefix(sizeof value);
  return true;
}

void put_place(std::string& text, const BlockPlace& place) {
  put(text, place.offset);
  put(text, place.bytes);
}

bool take_place(std::string_view& text, std::uint64_t end, BlockPlace& place) {
  return take(text, place.offset) && take(text, place.bytes) && place.offset <= end && place.bytes <= end - place.offset;
}

std::string to_text(const ChunkIndex& index) {
  std::string text;
  put(text, static_cast<std::uint32_t>(index.levels.size()));
  for (const auto& level : index.levels) {
    put(text, static_cast<std::uint32_t>(level.size()));
    for (const BlockPlace& place : level) put_place(text, place);
  }
  put(text, index.seed.width);
  put(text, index.seed.height);
  put_place(text, index.seed_place);
  put(text, static_cast<std::uint32_t>(index.bands.size()));
  for (const BandStatistics& band : index.bands) put(text, band);
  return text;
}

/// `end` is where the index begins: no block reaches beyond it.
bool from_text(std::string_view text, std::uint64_t end, ChunkIndex& index) {
  std::uint32_t levels = 0, bands = 0;
  if (!take(text, levels) || levels > 32) return false;
  index.levels.resize(levels);
  for (auto& level : index.levels) {
    std::uint32_t blocks = 0;
    if (!take(text, blocks) || blocks > text.size()) return false;
    level.resize(blocks);
    for (BlockPlace& place : level) {
      if (!take_place(text, end, place)) return false;
    }
  }
  if (!take(text, index.seed.width) || !take(text, index.seed.height) || !take_place(text, end, index.seed_place)) return false;
  if (!take(text, bands) || bands > text.size()) return false;
  index.bands.resize(bands);
  for (BandStatistics& band : index.bands) {
    if (!take(text, band)) return false;
  }
  return text.empty();
}

}  // namespace

Result<ChunkWriter> ChunkWriter::create(std::filesystem::path file) {
  std::filesystem::path part = file;
  part += fmt::format(".{}.part", getpid());
  ChunkWriter writer(std::move(file), std::move(part));
  writer.stream_.open(writer.part_, std::ios::binary);
  if (!writer.stream_) return writer.failure();
  return writer;
}

ChunkWriter::~ChunkWriter() {
  if (part_.empty()) return;  // finished, or moved from
  stream_.close();
  std::error_code ignored;
  std::filesystem::remove(part_, ignored);
}

Error ChunkWriter::failure() const {
  return {ErrorCode::unavailable, fmt::format("{} cannot be written: {}; is the folder writable, and is there room on the disk? The same command goes on from there",
                                              file_.string(), std::strerror(errno))};
}

Result<void> ChunkWriter::add(int level, std::span<const std::byte> block) {
  const auto at = static_cast<std::size_t>(level);
  if (index_.levels.size() <= at) index_.levels.resize(at + 1);
  index_.levels[at].push_back({written_, static_cast<std::uint32_t>(block.size())});
  stream_.write(reinterpret_cast<const char*>(block.data()), static_cast<std::streamsize>(block.size()));
  if (!stream_) return failure();
  written_ += block.size();
  return {};
}

Result<void> ChunkWriter::finish(const Samples& seed, const std::vector<BandStatistics>& bands) {
  index_.seed.width = seed.width;
  index_.seed.height = seed.height;
  index_.seed_place = {written_, static_cast<std::uint32_t>(seed.bytes.size())};
  index_.bands = bands;
  const std::string text = to_text(index_);
  Footer footer{written_ + seed.bytes.size(), fnv1a(text), {}};
  std::memcpy(footer.magic, kMagic, sizeof kMagic);
  stream_.write(reinterpret_cast<const char*>(seed.bytes.data()), static_cast<std::streamsize>(seed.bytes.size()));
  stream_.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream_.write(reinterpret_cast<const char*>(&footer), sizeof footer);
  stream_.close();
  if (!stream_) return failure();
  std::error_code error;
  std::filesystem::rename(part_, file_, error);
  if (error) return {ErrorCode::unavailable, fmt::format("{} cannot be written: {}", file_.string(), error.message())};
  part_.clear();
  return {};
}

Result<std::vector<std::byte>> read_bytes(const std::filesystem::path& file, std::uint64_t offset, std::uint64_t count) {
  std::vector<std::byte> bytes(count);
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(offset));
  if (!stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(count)))
    return {ErrorCode::unavailable, fmt::format("{}: cannot be read", file.string())};
  return bytes;
}

Result<ChunkIndex> read_chunk_index(const std::filesystem::path& file) {
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(file, error);
  if (error) return {ErrorCode::not_found, fmt::format("{}: is not there", file.string())};
  const Error damaged{ErrorCode::corrupt, fmt::format("{}: is damaged; remove it, and `tellurion ingest` makes it again", file.string())};
  if (size < sizeof(Footer)) return damaged;
  const auto end = read_bytes(file, size - sizeof(Footer), sizeof(Footer));
  if (!end) return end.error();
  Footer footer;
  std::memcpy(&footer, end->data(), sizeof footer);
  if (std::memcmp(footer.magic, kMagic, sizeof kMagic) != 0 || footer.index_offset > size - sizeof(Footer)) return damaged;
  const auto bytes = read_bytes(file, footer.index_offset, size - sizeof(Footer) - footer.index_offset);
  if (!bytes) return bytes.error();
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  ChunkIndex index;
  if (fnv1a(text) != footer.index_hash || !from_text(text, footer.index_offset, index)) return damaged;
  return index;
}

}  // namespace tellurion::prepare
