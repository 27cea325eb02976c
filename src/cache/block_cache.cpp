#include "cache/block_cache.h"

#include <condition_variable>
#include <list>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>
#include <variant>

namespace tellurion::cache {
namespace {

using Block = std::variant<Frozen<raster::HeightGrid>, Frozen<raster::Image>>;

/// Heights and colours of one source are different blocks.
struct Name {
  BlockKey key;
  bool is_image = false;

  friend bool operator==(const Name&, const Name&) = default;
};

struct NameHash {
  std::size_t operator()(const Name& n) const noexcept {
    std::uint64_t h = (std::uint64_t{n.key.source} << 33) ^ (std::uint64_t{n.key.level} << 1) ^ std::uint64_t{n.is_image};
    h ^= (std::uint64_t{static_cast<std::uint32_t>(n.key.column)} << 32 | static_cast<std::uint32_t>(n.key.row)) *
         0x9e3779b97f4a7c15ull;
    h ^= h >> 32;
    h += n.key.content;
    h *= 0xd6e8feb86659fd93ull;
    return static_cast<std::size_t>(h ^ (h >> 32));
  }
};

struct Entry {
  Name name;
  Block block;
  std::size_t bytes = 0;
  Remaking remaking = Remaking::dear;
  std::uint64_t used = 0;
};

/// Blocks of a kind, the most recently used first.
struct Shelf {
  std::list<Entry> entries;
  std::size_t bytes = 0;
};

/// A decoding under way: the first thread decodes, the others wait for `outcome`.
struct Flight {
  std::optional<Result<Block>> outcome;
};

}  // namespace

struct BlockCache::State {
  State(std::size_t budget, std::size_t share) : budget_bytes(budget), cheap_bytes(share) {}

  template <class Data, class Decode>
  Result<Frozen<Data>> find_or_decode(const Name& name, Remaking remaking, const Decode& decode);
  const Block& use(std::list<Entry>::iterator entry);
  void keep(Entry entry);
  void drop_oldest(Shelf& shelf);
  Shelf& shelf_of(Remaking remaking) { return remaking == Remaking::cheap ? cheap : dear; }

  const std::size_t budget_bytes;
  const std::size_t cheap_bytes;
  mutable std::mutex mutex;
  std::condition_variable landed;
  Shelf dear, cheap;
  std::uint64_t uses = 0;
  std::unordered_map<Name, std::list<Entry>::iterator, NameHash> index;
  std::unordered_map<Name, std::shared_ptr<Flight>, NameHash> flights;
  std::unordered_map<std::uint32_t, SourceReads> reads;
};

template <class Data, class Decode>
Result<Frozen<Data>> BlockCache::State::find_or_decode(const Name& name, Remaking remaking, const Decode& decode) {
  const auto typed = [](const Result<Block>& outcome) -> Result<Frozen<Data>> {
    if (!outcome) return outcome.error();
    return std::get<Frozen<Data>>(outcome.value());
  };

  std::unique_lock lock(mutex);
  if (const auto found = index.find(name); found != index.end()) return std::get<Frozen<Data>>(use(found->second));
  if (const auto flying = flights.find(name); flying != flights.end()) {
    const std::shared_ptr<Flight> flight = flying->second;
    landed.wait(lock, [&] { return flight->outcome.has_value(); });
    return typed(*flight->outcome);
  }
  const auto flight = std::make_shared<Flight>();
  flights.emplace(name, flight);
  lock.unlock();

  Result<Data> decoded = decode();
  Result<Block> outcome = decoded ? Result<Block>(Block(freeze(std::move(decoded).value()))) : Result<Block>(decoded.error());

  lock.lock();
  flight->outcome = std::move(outcome);
  flights.erase(name);
  SourceReads& done = reads[name.key.source];
  if (flight->outcome->has_value()) {
    const Block& block = flight->outcome->value();
    const std::size_t block_bytes = std::get<Frozen<Data>>(block)->bytes();
    ++done.blocks;
    done.bytes += static_cast<std::int64_t>(block_bytes);
    keep({name, block, sizeof(Entry) + block_bytes, remaking});
  } else if (const Error& error = flight->outcome->error(); error.code != ErrorCode::cancelled && error.code != ErrorCode::pending) {
    ++done.errors;
    if (error.code != ErrorCode::unavailable) ++done.lost;
    done.last_error = error.message;
  }
  lock.unlock();
  landed.notify_all();
  return typed(*flight->outcome);
}

const Block& BlockCache::State::use(std::list<Entry>::iterator entry) {
  std::list<Entry>& entries = shelf_of(entry->remaking).entries;
  entry->used = ++uses;
  entries.splice(entries.begin(), entries, entry);
  return entry->block;
}

void BlockCache::State::keep(Entry entry) {
  Shelf& shelf = shelf_of(entry.remaking);
  entry.used = ++uses;
  shelf.bytes += entry.bytes;
  shelf.entries.push_front(std::move(entry));
  index.emplace(shelf.entries.front().name, shelf.entries.begin());
  while (cheap.entries.size() > 1 && cheap.bytes > cheap_bytes) drop_oldest(cheap);
  while (index.size() > 1 && dear.bytes + cheap.bytes > budget_bytes) {
    const bool is_cheap = dear.entries.empty() || (!cheap.entries.empty() && cheap.entries.back().used < dear.entries.back().used);
    drop_oldest(is_cheap ? cheap : dear);
  }
}

void BlockCache::State::drop_oldest(Shelf& shelf) {
  shelf.bytes -= shelf.entries.back().bytes;
  index.erase(shelf.entries.back().name);
  shelf.entries.pop_back();
}

BlockCache::BlockCache(std::size_t budget_bytes, std::size_t cheap_bytes) : state_(std::make_unique<State>(budget_bytes, cheap_bytes)) {}
BlockCache::~BlockCache() = default;

Result<Frozen<raster::HeightGrid>> BlockCache::heights(const BlockKey& key, const DecodeHeights& decode) {
  return state_->find_or_decode<raster::HeightGrid>(Name{key, false}, Remaking::dear, decode);
}

Result<Frozen<raster::Image>> BlockCache::image(const BlockKey& key, const DecodeImage& decode, Remaking remaking) {
  return state_->find_or_decode<raster::Image>(Name{key, true}, remaking, decode);
}

Frozen<raster::HeightGrid> BlockCache::resident_heights(const BlockKey& key) {
  std::lock_guard lock(state_->mutex);
  const auto found = state_->index.find(Name{key, false});
  if (found == state_->index.end()) return {};
  return std::get<Frozen<raster::HeightGrid>>(state_->use(found->second));
}

SourceReads BlockCache::reads_of(std::uint32_t source) const {
  std::lock_guard lock(state_->mutex);
  const auto found = state_->reads.find(source);
  return found != state_->reads.end() ? found->second : SourceReads{};
}

std::size_t BlockCache::bytes() const {
  std::lock_guard lock(state_->mutex);
  return state_->dear.bytes + state_->cheap.bytes;
}

std::size_t BlockCache::budget_bytes() const { return state_->budget_bytes; }

}  // namespace tellurion::cache
