#include "source/gdal/remote_blocks.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include <fmt/format.h>

namespace tellurion::source {
namespace {

constexpr int kGroupRows = 256;                ///< rows of low blocks (strips) that are asked for together
constexpr std::uint64_t kJoinedGap = 64;       ///< bytes between blocks of a group that are fetched along: their frames, no other block

std::optional<std::uint64_t> number_of(GDALRasterBand& band, const char* what, int column, int row) {
  const char* text = band.GetMetadataItem(fmt::format("BLOCK_{}_{}_{}", what, column, row).c_str(), "TIFF");
  if (text == nullptr) return std::nullopt;
  const std::string_view digits(text);
  std::uint64_t number = 0;
  const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return failure == std::errc() ? std::optional(number) : std::nullopt;
}

/// Where a block's bytes are; nothing if the file leaves it out.
std::optional<fetch::ByteRange> place_of(GDALRasterBand& band, int column, int row) {
  const auto offset = number_of(band, "OFFSET", column, row), size = number_of(band, "SIZE", column, row);
  if (!offset || !size || *size == 0) return std::nullopt;
  return fetch::ByteRange{*offset, *size};
}

/// Ranges that nearly touch become one.
void join(std::vector<fetch::ByteRange>& ranges) {
  std::sort(ranges.begin(), ranges.end(), [](const auto& a, const auto& b) { return a.offset < b.offset; });
  std::vector<fetch::ByteRange> joined;
  for (const fetch::ByteRange& range : ranges) {
    if (!joined.empty() && range.offset - joined.back().offset <= joined.back().length + kJoinedGap) {
      fetch::ByteRange& last = joined.back();
      last.length = std::max(last.length, range.offset - last.offset + range.length);
    } else {
      joined.push_back(range);
    }
  }
  ranges = std::move(joined);
}

}  // namespace

/// `rows` blocks of a column, asked for as one where they lie together: which ones depends on the file alone, so that each
/// byte has one name in the caches.
Result<void> RemoteBlocks::bring_group(GDALRasterBand& band, int column, int first_row, int rows, double gain) {
  std::vector<fetch::ByteRange> ranges;
  for (int row = first_row; row < first_row + rows; ++row) {
    if (const auto place = place_of(band, column, row)) ranges.push_back(*place);
  }
  const std::uint64_t size = mount_.file().size();
  if (std::all_of(ranges.begin(), ranges.end(), [&](const auto& range) { return range.offset <= size && range.length <= size - range.offset; })) join(ranges);
  std::optional<Error> error;
  for (const fetch::ByteRange& range : ranges) {
    if (std::find(brought_.begin(), brought_.end(), range) != brought_.end()) continue;
    if (auto kept = mount_.chunks().kept(range)) {
      mount_.put(range.offset, std::move(kept));
      continue;
    }
    fetch::Asked asked = mount_.file().ask(range, gain);
    if (auto* file = std::get_if<fetch::File>(&asked)) {
      if (!file->bytes) return Error{ErrorCode::unavailable, fmt::format("{}: has gone from the server", mount_.file().name())};
      mount_.put(range.offset, std::move(file->bytes));
      brought_.push_back(range);
    } else if (auto* failure = std::get_if<Error>(&asked)) {
      error = std::move(*failure);
    } else {
      awaited_.push_back(std::move(std::get<std::shared_ptr<fetch::Arrival>>(asked)));
      if (!error) error = Error{ErrorCode::pending, mount_.file().name()};
    }
  }
  return error ? Result<void>(std::move(*error)) : Result<void>();
}

Result<void> RemoteBlocks::bring(GDALRasterBand& band, const PixelWindow& window) {
  int width = 0, height = 0;
  band.GetBlockSize(&width, &height);
  const int group = std::max(1, kGroupRows / std::max(height, 1));
  const int rows_in_all = (band.GetYSize() + height - 1) / height;
  const int last_row = (window.y + window.height - 1) / height, last_column = (window.x + window.width - 1) / width;
  const double gain = -std::log2(std::max(band.GetXSize(), 1));  // the coarser first
  std::optional<Error> error;
  for (int first = window.y / height / group * group; first <= last_row; first += group) {
    for (int column = window.x / width; column <= last_column; ++column) {
      bool decoded = true;
      for (int row = std::max(first, window.y / height); row <= std::min(last_row, first + group - 1); ++row) {
        GDALRasterBlock* block = band.TryGetLockedBlockRef(column, row);
        if (block != nullptr) locked_.push_back(block);
        else decoded = false;
      }
      if (decoded) continue;
      Result<void> brought = bring_group(band, column, first, std::min(group, rows_in_all - first), gain);
      if (brought) continue;
      if (!error || error->code == ErrorCode::pending) error = brought.error();
    }
  }
  if (mount_.failure()) return *mount_.failure();
  return error ? Result<void>(std::move(*error)) : Result<void>();
}

Awaited RemoteBlocks::take_awaited() { return std::exchange(awaited_, {}); }

void RemoteBlocks::release() {
  for (GDALRasterBlock* block : locked_) block->DropLock();
  locked_.clear();
  brought_.clear();
  mount_.drop_pieces();
}

void RemoteBlocks::reject(const std::string& why) {
  for (const fetch::ByteRange& range : brought_) mount_.file().reject(range, why);
}

}  // namespace tellurion::source
