// PMTiles archives as pyramids of tiles.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <variant>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/gzip.h"
#include "source/tiles/archive_tile.h"
#include "source/tiles/height_decoders.h"
#include "source/tiles/file_parts.h"
#include "source/tiles/pmtiles.h"
#include "source/tiles/tile_archive.h"
#include "source/tiles/tile_pyramid.h"

namespace tellurion::source {
namespace {

constexpr std::chrono::milliseconds kPatience{30'000};        ///< for what is read at opening
constexpr std::size_t kMostTileBytes = std::size_t{16} << 20;  ///< unpacked
constexpr std::size_t kMostKeptEntries = std::size_t{1} << 20; ///< of leaf directories, in memory: 24 MB

class PmtilesArchive final : public TileSupply {
 public:
  PmtilesArchive(std::unique_ptr<const FileParts> file, const pmtiles::Header& header, std::shared_ptr<const pmtiles::Directory> root)
      : file_(std::move(file)), header_(header), root_(std::move(root)) {}

  fetch::Asked ask(const TileAddress& tile, const TileWish& wish) const override {
    const double gain = wish.gain;
    Located located = locate(tile, gain);
    if (auto* asked = std::get_if<fetch::Asked>(&located)) return std::move(*asked);
    return contents(std::get<fetch::ByteRange>(located), gain);
  }
  void reject(const TileAddress& tile, const std::string& why) const override {
    const Located located = locate(tile, 0);
    if (const auto* range = std::get_if<fetch::ByteRange>(&located)) file_->reject(*range, why);
  }
  std::string name_of(const TileAddress& tile) const override {
    return fmt::format("{}, tile of zoom {}, column {}, row {}", file_->name(), tile.zoom, tile.column, tile.row);
  }

  /// The first tile, which is one of the coarsest there are; waits for it.
  Result<std::string> first_tile() const;

 private:
  /// Where a tile is; or what is to be said instead: there is none, an error, or its directory is on its way.
  using Located = std::variant<fetch::ByteRange, fetch::Asked>;
  using Leaf = std::variant<std::shared_ptr<const pmtiles::Directory>, fetch::Asked>;

  Error error(const Error& of) const { return {of.code, fmt::format("{}: {}", file_->name(), of.message)}; }
  Located locate(const TileAddress& tile, double gain) const;
  Leaf leaf(const fetch::ByteRange& place, double gain) const;
  fetch::Asked contents(const fetch::ByteRange& place, double gain) const;

  std::unique_ptr<const FileParts> file_;
  pmtiles::Header header_;
  std::shared_ptr<const pmtiles::Directory> root_;

  struct Kept {
    std::uint64_t offset = 0;
    std::shared_ptr<const pmtiles::Directory> directory;
  };
  mutable std::mutex mutex_;  ///< guards what follows
  mutable std::list<Kept> leaves_;  ///< the most recently used first
  mutable std::size_t entries_ = 0;
};

PmtilesArchive::Leaf PmtilesArchive::leaf(const fetch::ByteRange& place, double gain) const {
  {
    std::lock_guard lock(mutex_);
    const auto found = std::find_if(leaves_.begin(), leaves_.end(), [&](const Kept& kept) { return kept.offset == place.offset; });
    if (found != leaves_.end()) {
      leaves_.splice(leaves_.begin(), leaves_, found);
      return leaves_.front().directory;
    }
  }
  fetch::Asked asked = file_->ask(place, gain);
  const auto* file = std::get_if<fetch::File>(&asked);
  if (!file) return asked;
  if (!file->bytes) return fetch::Asked(Error{ErrorCode::unavailable, fmt::format("{}: has gone from the server", file_->name())});
  Result<pmtiles::Directory> read = pmtiles::read_directory(*file->bytes, header_.directories);
  if (!read) {
    const Error why = error(read.error());
    file_->reject(place, why.message);
    return fetch::Asked(why);
  }
  auto directory = std::make_shared<const pmtiles::Directory>(std::move(*read));
  std::lock_guard lock(mutex_);
  leaves_.push_front({place.offset, directory});
  entries_ += directory->size();
  while (leaves_.size() > 1 && entries_ > kMostKeptEntries) {
    entries_ -= leaves_.back().directory->size();
    leaves_.pop_back();
  }
  return directory;
}

PmtilesArchive::Located PmtilesArchive::locate(const TileAddress& tile, double gain) const {
  const std::uint64_t number = pmtiles::number_of(tile);
  std::shared_ptr<const pmtiles::Directory> directory = root_;
  for (int depth = 1; depth <= pmtiles::kMostDepth; ++depth) {
    const auto entry = pmtiles::find(*directory, number);
    if (!entry) return fetch::Asked(fetch::File{});
    const Result<fetch::ByteRange> place = pmtiles::place_of(*entry, header_);
    if (!place) return fetch::Asked(error(place.error()));
    if (entry->tiles > 0) return *place;
    Leaf next = leaf(*place, gain);
    if (auto* asked = std::get_if<fetch::Asked>(&next)) return std::move(*asked);
    directory = std::move(std::get<std::shared_ptr<const pmtiles::Directory>>(next));
  }
  return fetch::Asked(error({ErrorCode::corrupt, fmt::format("its directories lie more than {} deep in one another", pmtiles::kMostDepth)}));
}

fetch::Asked PmtilesArchive::contents(const fetch::ByteRange& place, double gain) const {
  fetch::Asked asked = file_->ask(place, gain);
  auto* file = std::get_if<fetch::File>(&asked);
  if (!file || !file->bytes || header_.contents == pmtiles::Compression::none) return asked;
  Result<std::string> unpacked = gunzip(*file->bytes, kMostTileBytes);
  if (!unpacked) {
    const Error why = error({unpacked.error().code, "a tile in it: " + unpacked.error().message});
    file_->reject(place, why.message);
    return why;
  }
  file->bytes = std::make_shared<const std::string>(std::move(*unpacked));
  return asked;
}

/// Whom to credit, if the archive says so among its first bytes: nothing is fetched for it.
std::string attribution_in(const std::string& head, const pmtiles::Header& header) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 20;
  const fetch::ByteRange& place = header.metadata;
  if (place.length == 0 || place.offset > head.size() || place.length > head.size() - place.offset) return {};
  std::string text = head.substr(static_cast<std::size_t>(place.offset), static_cast<std::size_t>(place.length));
  if (header.directories == pmtiles::Compression::gzip) text = gunzip(text, kMostBytes).value_or({});
  const auto metadata = nlohmann::json::parse(text, nullptr, false);
  if (!metadata.is_object()) return {};
  const auto found = metadata.find("attribution");
  return found != metadata.end() && found->is_string() ? found->get<std::string>() : std::string();
}

Result<std::string> PmtilesArchive::first_tile() const {
  std::shared_ptr<const pmtiles::Directory> directory = root_;
  for (int depth = 1; depth <= pmtiles::kMostDepth; ++depth) {
    const pmtiles::Entry& entry = directory->front();
    const Result<fetch::ByteRange> place = pmtiles::place_of(entry, header_);
    if (!place) return error(place.error());
    if (Result<void> there = file_->wait_for(*place, kPatience); !there) return there.error();
    if (entry.tiles > 0) {
      const fetch::Asked asked = contents(*place, 0);
      const auto* file = std::get_if<fetch::File>(&asked);
      if (file && file->bytes) return *file->bytes;
      const auto* failure = std::get_if<Error>(&asked);
      return failure ? *failure : Error{ErrorCode::unavailable, fmt::format("{}: its first tile cannot be read", file_->name())};
    }
    Leaf next = leaf(*place, 0);
    if (auto* found = std::get_if<std::shared_ptr<const pmtiles::Directory>>(&next)) {
      directory = std::move(*found);
      continue;
    }
    const auto* failure = std::get_if<Error>(&std::get<fetch::Asked>(next));
    return failure ? *failure : Error{ErrorCode::unavailable, fmt::format("{}: its directories cannot be read", file_->name())};
  }
  return error({ErrorCode::corrupt, fmt::format("its directories lie more than {} deep in one another", pmtiles::kMostDepth)});
}

std::optional<std::array<double, 4>> bounds_in(const pmtiles::Header& header) {
  const auto& b = header.bounds;
  const bool good = b[0] >= -180.0 && b[2] <= 180.0 && b[1] >= -90.0 && b[3] <= 90.0 && b[0] < b[2] && b[1] < b[3];
  return good ? std::optional(b) : std::nullopt;
}

}  // namespace

Result<std::unique_ptr<RasterSource>> open_pmtiles(const TileArchive& archive, const geo::Ellipsoid& world, std::shared_ptr<fetch::ByteStore> store) {
  const bool remote = !archive.url.empty();
  Result<std::unique_ptr<const FileParts>> opened =
      remote ? open_remote_parts(std::move(store), archive.url, archive.headers, pmtiles::kHeadBytes, kPatience) : open_local_parts(archive.file, pmtiles::kHeadBytes);
  if (!opened) return opened.error();
  std::unique_ptr<const FileParts> file = std::move(*opened);
  const std::string name = file->name(), revision = file->revision();
  const auto naming = [&](const Error& error) { return Error{error.code, fmt::format("{}: {}", name, error.message)}; };
  const std::string& head = file->head();
  const Result<pmtiles::Header> header = pmtiles::read_header(head, file->size());
  if (!header) {
    const Error why = naming(header.error());
    file->reject({0, 1}, why.message);  // it may be mended on the server
    return why;
  }
  std::string attribution = attribution_in(head, *header);
  Result<pmtiles::Directory> root = pmtiles::read_directory(std::string_view(head).substr(static_cast<std::size_t>(header->root.offset), static_cast<std::size_t>(header->root.length)), header->directories);
  if (!root) {
    const Error why = naming(root.error());
    file->reject({0, 1}, why.message);
    return why;
  }
  const auto supply = std::make_shared<const PmtilesArchive>(std::move(file), *header, std::make_shared<const pmtiles::Directory>(std::move(*root)));
  const Result<std::string> tile = supply->first_tile();
  if (!tile) return tile.error();
  const Result<int> side = side_of_tile(*tile, name);
  if (!side) return side.error();
  Result<TileGrid> grid = web_mercator_grid(*side, header->min_zoom, std::max(header->min_zoom, std::min(header->max_zoom, deepest_zoom(*side))));
  if (!grid) return naming(grid.error());

  TilePyramid pyramid;
  pyramid.name = name;
  pyramid.revision = revision;
  pyramid.grid = std::move(*grid);
  pyramid.kind = archive.kind;
  pyramid.decode_heights = height_decoder(archive.encoding, pyramid.grid);
  pyramid.encoding = archive.encoding;
  pyramid.bounds = archive.bounds ? archive.bounds : bounds_in(*header);
  pyramid.vertical = archive.vertical;
  pyramid.is_remote = remote;
  pyramid.attribution = std::move(attribution);
  pyramid.supply = supply;
  return open_pyramid(std::move(pyramid), world);
}

}  // namespace tellurion::source
