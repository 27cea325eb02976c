#include "prepare/gdal/chunk_worker.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "prepare/chunk_file.h"
#include "prepare/gdal/block_codec.h"
#include "prepare/pyramid.h"

namespace tellurion::prepare {

std::size_t worker_bytes(const OutputPlan& plan, const RepairPlan& repair) {
  constexpr std::size_t kStrips = 7;  // what is read, GDAL's working copies, and the halves of all levels
  constexpr std::size_t kBlocks = 6;  // as samples, in GDAL's file in memory, compressed
  const auto block = static_cast<std::size_t>(plan.block), pixel = plan.layout.pixel_bytes();
  return kStrips * static_cast<std::size_t>(plan.chunk_width) * block * pixel + kBlocks * block * block * pixel + (std::size_t{4} << 20) +
         repair.bytes(plan);
}

Result<ChunkWorker> ChunkWorker::create(const Mosaic& mosaic, std::filesystem::path folder) {
  Result<RepairedReader> reader = RepairedReader::create(mosaic);
  if (!reader) return reader.error();
  return ChunkWorker(mosaic.plan(), std::move(*reader), std::move(folder));
}

Result<void> ChunkWorker::make(int index) {
  const OutputPlan& plan = *plan_;
  const Chunk chunk = chunk_of(plan, index);
  const int last_level = plan.last_chunk_level();
  Result<ChunkWriter> writer = ChunkWriter::create(folder_ / chunk_file_name(plan, index));
  if (!writer) return writer.error();
  Samples seed;
  std::vector<BandStatistics> found(static_cast<std::size_t>(plan.layout.bands));
  const auto take = [&](int level, int, const Samples& strip) -> Result<void> {
    for (int x = 0; x < strip.width; x += plan.block) {
      const Samples block = cut_block(plan.layout, strip, x, 0, plan.block);
      std::vector<std::byte> bytes;
      if (!is_blank(plan.layout, block)) {
        Result<std::vector<std::byte>> compressed = compress_block(plan, block);
        if (!compressed) return compressed.error();
        bytes = std::move(*compressed);
      }
      if (Result<void> added = writer->add(level, bytes); !added) return added;
    }
    if (level == last_level) {
      seed.width = strip.width;
      seed.height += strip.height;
      seed.bytes.insert(seed.bytes.end(), strip.bytes.begin(), strip.bytes.end());
    }
    return {};
  };
  PyramidStream pyramid(plan.layout, chunk.width, chunk.height, plan.block, last_level, take);
  for (int y = 0; y < chunk.height; y += plan.block) {
    Result<Samples> strip = reader_.read(chunk.x, chunk.y + y, chunk.width, std::min(plan.block, chunk.height - y));
    if (!strip) return strip.error();
    const std::vector<BandStatistics> more = statistics(plan.layout, *strip);
    for (std::size_t band = 0; band < found.size(); ++band) found[band].add(more[band]);
    if (Result<void> pushed = pyramid.push(std::move(*strip)); !pushed) return pushed;
  }
  return writer->finish(seed, found);
}

}  // namespace tellurion::prepare
