#include "prepare/gdal/join.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "base/hash.h"
#include "prepare/chunk_file.h"
#include "prepare/gdal/block_codec.h"
#include "prepare/parallel.h"
#include "prepare/pyramid.h"
#include "prepare/tiff.h"

namespace tellurion::prepare {
namespace {

namespace fs = std::filesystem;

struct ChunkPart {
  fs::path file;     ///< empty: the chunk is blank
  ChunkIndex index;
};

int blocks_across(int pixels, int block) { return (pixels + block - 1) / block; }

/// A row of chunks at their coarsest level, side by side.
Result<Samples> seed_strip(const OutputPlan& plan, const std::vector<ChunkPart>& parts, int chunk_row) {
  const int level = plan.last_chunk_level(), columns = plan.chunk_columns();
  const Chunk first = chunk_of(plan, chunk_row * columns);
  Samples strip = make_blank(plan.layout, size_at(plan.width, level), size_at(first.height, level));
  const std::size_t pixel = plan.layout.pixel_bytes();
  for (int column = 0; column < columns; ++column) {
    const ChunkPart& part = parts[static_cast<std::size_t>(chunk_row * columns + column)];
    if (part.file.empty()) continue;
    const Samples& seed = part.index.seed;
    const Chunk chunk = chunk_of(plan, chunk_row * columns + column);
    const std::size_t row = static_cast<std::size_t>(seed.width) * pixel;
    if (seed.width != size_at(chunk.width, level) || seed.height != strip.height || part.index.seed_place.bytes != row * static_cast<std::size_t>(seed.height)) {
      return {ErrorCode::corrupt, fmt::format("{}: is damaged; remove it, and `tellurion ingest` makes it again", part.file.string())};
    }
    Result<std::vector<std::byte>> bytes = read_bytes(part.file, part.index.seed_place.offset, part.index.seed_place.bytes);
    if (!bytes) return bytes.error();
    const std::size_t left = static_cast<std::size_t>(chunk.x >> level) * pixel, whole = static_cast<std::size_t>(strip.width) * pixel;
    for (std::size_t y = 0; y < static_cast<std::size_t>(seed.height); ++y) std::memcpy(strip.bytes.data() + y * whole + left, bytes->data() + y * row, row);
  }
  return strip;
}

/// The levels above the chunks', as a file like that of a chunk; its level 0 is the first of them.
Result<ChunkPart> make_top_levels(const OutputPlan& plan, const std::vector<ChunkPart>& parts, const fs::path& folder, int workers) {
  std::string made_of = plan.description();
  for (const std::string& hash : plan.chunk_hashes) made_of += "|" + hash;
  const fs::path file = folder / fmt::format("tops-{:016x}.blocks", fnv1a(made_of));
  if (Result<ChunkIndex> index = read_chunk_index(file)) return ChunkPart{file, std::move(*index)};
  Result<ChunkWriter> writer = ChunkWriter::create(file);
  if (!writer) return writer.error();
  const int base = plan.last_chunk_level(), levels = plan.level_count() - base;
  const auto take = [&](int level, int, const Samples& strip) -> Result<void> {
    if (level == 0) return {};  // the chunks have it
    const int count = blocks_across(strip.width, plan.block);
    std::vector<std::vector<std::byte>> blocks(static_cast<std::size_t>(count));
    Result<void> made = for_each_item(count, workers, [&](int, int i) -> Result<void> {
      const Samples block = cut_block(plan.layout, strip, i * plan.block, 0, plan.block);
      if (is_blank(plan.layout, block)) return {};
      Result<std::vector<std::byte>> bytes = compress_block(plan, block);
      if (!bytes) return bytes.error();
      blocks[static_cast<std::size_t>(i)] = std::move(*bytes);
      return {};
    });
    if (!made) return made;
    for (const auto& block : blocks) {
      if (Result<void> added = writer->add(level - 1, block); !added) return added;
    }
    return {};
  };
  PyramidStream pyramid(plan.layout, size_at(plan.width, base), size_at(plan.height, base), plan.block, levels - 1, take);
  for (int row = 0; row < plan.chunk_rows(); ++row) {
    Result<Samples> strip = seed_strip(plan, parts, row);
    if (!strip) return strip.error();
    if (Result<void> pushed = pyramid.push(std::move(*strip)); !pushed) return pushed.error();
  }
  if (Result<void> finished = writer->finish({}, {}); !finished) return finished.error();
  Result<ChunkIndex> index = read_chunk_index(file);
  if (!index) return index.error();
  return ChunkPart{file, std::move(*index)};
}

/// Blocks of one row of a level that lie side by side in one file.
struct Run {
  const ChunkPart* part = nullptr;  ///< nothing: blank
  const BlockPlace* places = nullptr;
  int count = 0;
};

/// Walks over the blocks of a level, row by row, in runs. Errors: corrupt; those of `work`.
template <class Work>
Result<void> for_each_run(const OutputPlan& plan, const std::vector<ChunkPart>& parts, const ChunkPart& tops, int level, const Work& work) {
  const int columns = blocks_across(size_at(plan.width, level), plan.block), rows = blocks_across(size_at(plan.height, level), plan.block);
  const bool in_chunks = level <= plan.last_chunk_level();
  const int chunk_columns = in_chunks ? (plan.chunk_width / plan.block) >> level : columns, chunk_rows = in_chunks ? (plan.chunk_height / plan.block) >> level : rows;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; column += chunk_columns) {
      const ChunkPart& part = in_chunks ? parts[static_cast<std::size_t>(row / chunk_rows * plan.chunk_columns() + column / chunk_columns)] : tops;
      Run run{nullptr, nullptr, std::min(chunk_columns, columns - column)};
      if (!part.file.empty()) {
        const auto at = static_cast<std::size_t>(in_chunks ? level : level - plan.last_chunk_level() - 1);
        const auto first = static_cast<std::size_t>(row % chunk_rows) * static_cast<std::size_t>(run.count);
        if (part.index.levels.size() <= at || part.index.levels[at].size() < first + static_cast<std::size_t>(run.count)) {
          return {ErrorCode::corrupt, fmt::format("{}: is damaged; remove it, and `tellurion ingest` makes it again", part.file.string())};
        }
        run.part = &part;
        run.places = part.index.levels[at].data() + first;
      }
      if (Result<void> done = work(run); !done) return done;
    }
  }
  return {};
}

Result<void> write_blocks(const Run& run, std::ofstream& stream) {
  if (run.part == nullptr) return {};
  std::uint64_t bytes = 0;
  for (int i = 0; i < run.count; ++i) bytes += run.places[i].bytes;
  if (bytes == 0) return {};
  const Result<std::vector<std::byte>> read = read_bytes(run.part->file, run.places[0].offset, bytes);
  if (!read) return read.error();
  std::vector<std::byte> framed;
  framed.reserve(bytes + static_cast<std::size_t>(run.count) * kBlockFrameBytes);
  auto from = read->begin();
  for (int i = 0; i < run.count; ++i) {
    const std::uint32_t length = run.places[i].bytes;
    if (length == 0) continue;
    for (int shift = 0; shift < 32; shift += 8) framed.push_back(static_cast<std::byte>(length >> shift & 0xff));
    framed.insert(framed.end(), from, from + length);
    std::byte last[4]{};
    const std::uint32_t repeated = std::min<std::uint32_t>(length, 4);
    std::copy(from + (length - repeated), from + length, last + (4 - repeated));
    framed.insert(framed.end(), last, last + 4);
    from += length;
  }
  stream.write(reinterpret_cast<const char*>(framed.data()), static_cast<std::streamsize>(framed.size()));
  return {};
}

}  // namespace

Result<std::vector<fs::path>> find_chunks(const OutputPlan& plan, const std::vector<fs::path>& folders) {
  std::vector<fs::path> chunks(plan.chunk_hashes.size());
  int missing = 0;
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    if (plan.chunk_hashes[i].empty()) continue;
    const std::string name = chunk_file_name(plan, static_cast<int>(i));
    for (const fs::path& folder : folders) {
      std::error_code error;
      if (!fs::exists(folder / name, error)) continue;
      chunks[i] = folder / name;
      break;
    }
    if (chunks[i].empty()) ++missing;
  }
  if (missing == 0) return chunks;
  return {ErrorCode::not_found, fmt::format("{}: {} of {} chunks are not there; let every shard end first, or name the folders of the others too", folders.front().string(), missing, chunks.size())};
}

Result<std::uint64_t> join_chunks(const OutputPlan& plan, const std::vector<fs::path>& chunks, const fs::path& folder, const fs::path& out, int workers) {
  std::vector<ChunkPart> parts;
  std::vector<BandStatistics> found(static_cast<std::size_t>(plan.layout.bands));
  for (const fs::path& chunk : chunks) {
    ChunkPart part{chunk, {}};
    if (!chunk.empty()) {
      Result<ChunkIndex> index = read_chunk_index(chunk);
      if (!index) return index.error();
      part.index = std::move(*index);
      for (std::size_t band = 0; band < std::min(found.size(), part.index.bands.size()); ++band) found[band].add(part.index.bands[band]);
    }
    parts.push_back(std::move(part));
  }
  ChunkPart tops;
  if (plan.level_count() > plan.last_chunk_level() + 1) {
    Result<ChunkPart> made = make_top_levels(plan, parts, folder, workers);
    if (!made) return made.error();
    tops = std::move(*made);
  }
  Result<std::vector<TiffDirectory>> directories = describe_levels(plan, found);
  if (!directories) return directories.error();
  std::vector<CogLevel> levels;
  for (int level = 0; level < plan.level_count(); ++level) {
    CogLevel one{std::move((*directories)[static_cast<std::size_t>(level)]), {}};
    Result<void> listed = for_each_run(plan, parts, tops, level, [&](const Run& run) -> Result<void> {
      for (int i = 0; i < run.count; ++i) one.block_bytes.push_back(run.part != nullptr ? run.places[i].bytes : 0);
      return {};
    });
    if (!listed) return listed.error();
    levels.push_back(std::move(one));
  }
  const CogHead head = lay_out_cog(levels);

  fs::path part = out;
  part += fmt::format(".{}.part", getpid());
  std::ofstream stream(part, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(head.bytes.data()), static_cast<std::streamsize>(head.bytes.size()));
  Result<void> written;
  for (int level = plan.level_count(); level-- > 0 && written && stream;) {
    written = for_each_run(plan, parts, tops, level, [&](const Run& run) -> Result<void> {
      if (Result<void> one = write_blocks(run, stream); !one) return one;
      return stream ? Result<void>{} : Error{ErrorCode::unavailable, ""};
    });
  }
  const int reason = errno;
  stream.close();
  std::error_code error;
  if (stream && written) fs::rename(part, out, error);
  if (stream && written && !error) return head.file_bytes;
  std::error_code ignored;
  fs::remove(part, ignored);
  if (stream && !written) return written.error();
  return {ErrorCode::unavailable, fmt::format("{} cannot be written: {}; is the folder there and writable, and is there room on the disk?", out.string(), error ? error.message() : std::strerror(reason))};
}

}  // namespace tellurion::prepare
