#include "source/tiles/url_tiles.h"

#include <utility>

#include <fmt/format.h>

namespace tellurion::source {
namespace {

class UrlTiles final : public TileSupply {
 public:
  UrlTiles(TileTemplate address, std::vector<std::string> headers, std::string key_prefix, const TileGrid& grid, std::shared_ptr<fetch::ByteStore> store,
           std::function<bool(const TileAddress&)> may_have)
      : address_(std::move(address)), headers_(std::move(headers)), key_prefix_(std::move(key_prefix)), store_(std::move(store)), may_have_(std::move(may_have)) {
    for (const TileLevel& level : grid.levels) rows_.push_back(level.rows);
  }

  fetch::Asked ask(const TileAddress& tile, const TileWish& wish) const override {
    if (may_have_ && !may_have_(tile)) return fetch::File{};
    return store_->ask({url_of(tile), headers_, key_of(tile), {}, wish.expected_bytes}, wish.gain);
  }
  void reject(const TileAddress& tile, const std::string& why) const override { store_->reject(key_of(tile), why); }
  std::string name_of(const TileAddress& tile) const override { return fetch::public_part(url_of(tile)); }

 private:
  std::string url_of(const TileAddress& tile) const { return address_.url(tile, rows_[static_cast<std::size_t>(tile.zoom)]); }
  std::string key_of(const TileAddress& tile) const { return fmt::format("{}/{}/{}/{}", key_prefix_, tile.zoom, tile.column, tile.row); }

  TileTemplate address_;
  std::vector<std::string> headers_;
  std::string key_prefix_;
  std::vector<std::int64_t> rows_;  ///< by zoom
  std::shared_ptr<fetch::ByteStore> store_;
  std::function<bool(const TileAddress&)> may_have_;  ///< none: all may exist
};

}  // namespace

std::shared_ptr<const TileSupply> url_tiles(TileTemplate address, std::vector<std::string> headers, std::string key_prefix, const TileGrid& grid,
                                            std::shared_ptr<fetch::ByteStore> store, std::function<bool(const TileAddress&)> may_have) {
  return std::make_shared<UrlTiles>(std::move(address), std::move(headers), std::move(key_prefix), grid, std::move(store), std::move(may_have));
}

}  // namespace tellurion::source
