#include "fetch/byte_store.h"

#include <algorithm>
#include <atomic>
#include <list>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "base/log.h"
#include "fetch/disk_cache.h"

namespace tellurion::fetch {
namespace {

using Steady = std::chrono::steady_clock;
using System = std::chrono::system_clock;

constexpr std::chrono::hours kLongestRetryAfter{1};  ///< that is believed of a server
constexpr const char* kModified = "modified ";  ///< begins a version that is a date; no tag does
constexpr std::size_t kEntryBytes = 256;  ///< of an entry beside its file

struct Entry {
  std::string key;
  std::variant<File, Error> content;
  Steady::time_point valid_until;
  std::size_t bytes = 0;
  int failures = 0;  ///< in a row
};

File file_of(DiskEntry entry) {
  if (entry.missing) return {};
  return {std::make_shared<const std::string>(std::move(entry.body)), std::move(entry.content_type), std::move(entry.etag), entry.whole_bytes};
}

}  // namespace

struct ByteStore::State : std::enable_shared_from_this<State> {
  explicit State(const StoreOptions& o) : options(o) {}

  struct Flight {
    std::weak_ptr<Arrival> arrival;
    Fetcher::Ticket ticket = 0;
    std::uint64_t number = 0;
  };

  const StoreOptions options;
  std::unique_ptr<DiskCache> disk;  ///< null: none
  std::atomic<std::int64_t> not_kept{0};  ///< FetchStats::not_kept

  std::mutex mutex;  ///< guards what follows
  std::list<Entry> entries;  ///< the most recently used first
  std::unordered_map<std::string, std::list<Entry>::iterator> index;
  std::size_t bytes = 0;
  std::unordered_map<std::string, Flight> flights;
  std::uint64_t flight_number = 0;

  std::unique_ptr<Fetcher> fetcher;  ///< last: its thread ends before what it uses; null: offline

  std::optional<Asked> find(const std::string& key);
  void keep(std::string key, std::variant<File, Error> content, Steady::duration lifetime);
  void keep_failure(const std::string& key, Error error, Steady::duration least_pause = {});
  void forget(const std::string& key);
  Asked begin(const Request& request, double gain);
  void put(const std::string& key, const DiskEntry& entry);
  std::variant<File, Error> take(const Request& request, Outcome outcome);
  void arrived(const Request& request, std::uint64_t number, Outcome outcome);
  void abandoned(const std::string& key, std::uint64_t number);
};

void ByteStore::State::forget(const std::string& key) {
  const auto found = index.find(key);
  if (found == index.end()) return;
  bytes -= found->second->bytes;
  entries.erase(found->second);
  index.erase(found);
}

void ByteStore::State::keep(std::string key, std::variant<File, Error> content, Steady::duration lifetime) {
  forget(key);
  const File* file = std::get_if<File>(&content);
  const std::size_t size = kEntryBytes + key.size() + (file && file->bytes ? file->bytes->size() : 0);
  entries.push_front(Entry{key, std::move(content), Steady::now() + lifetime, size});
  index.emplace(std::move(key), entries.begin());
  bytes += size;
  while (entries.size() > 1 && bytes > options.memory_bytes) forget(std::string(entries.back().key));
}

/// Asked for again after a pause, a longer one each time, and not before the server allows it.
void ByteStore::State::keep_failure(const std::string& key, Error error, Steady::duration least_pause) {
  constexpr int kMostDoublings = 10;
  const auto last = index.find(key);
  const int failures = last != index.end() ? std::min(last->second->failures, kMostDoublings) : 0;
  const Steady::duration pause = std::min(options.pause_after_failure * (1 << failures), options.longest_pause);
  keep(key, std::move(error), std::max(pause, least_pause));
  index.find(key)->second->failures = failures + 1;
}

/// What memory has, or the flight that brings it.
std::optional<Asked> ByteStore::State::find(const std::string& key) {
  if (const auto found = index.find(key); found != index.end()) {
    if (Steady::now() < found->second->valid_until) {
      entries.splice(entries.begin(), entries, found->second);
      return std::visit([](const auto& content) { return Asked(content); }, found->second->content);
    }
    if (found->second->failures == 0) forget(key);
  }
  if (const auto flying = flights.find(key); flying != flights.end()) {
    if (auto arrival = flying->second.arrival.lock()) return Asked(std::move(arrival));
  }
  return std::nullopt;
}

/// The last holder of an arrival let it go.
void ByteStore::State::abandoned(const std::string& key, std::uint64_t number) {
  std::lock_guard lock(mutex);
  const auto flying = flights.find(key);
  if (flying == flights.end() || flying->second.number != number) return;
  if (fetcher) fetcher->cancel(flying->second.ticket);  // none: the store is going
  flights.erase(flying);
}

/// Starts a transfer; called with the mutex held.
Asked ByteStore::State::begin(const Request& request, double gain) {
  const std::uint64_t number = ++flight_number;
  const Gain order = make_gain(gain);
  std::shared_ptr<Arrival> arrival(new Arrival(order, request.expected_bytes), [weak = weak_from_this(), key = request.key, number](Arrival* gone) {
    if (const auto state = weak.lock()) state->abandoned(key, number);
    delete gone;
  });
  const auto ticket = fetcher->start(request, order, [weak = weak_from_this(), request, number](Outcome outcome) {
    if (const auto state = weak.lock()) state->arrived(request, number, std::move(outcome));
  });
  Flight& flight = flights[request.key];
  if (flight.number > 0) fetcher->cancel(flight.ticket);  // let go of by its last holder, who is about to say so
  flight = {arrival, ticket, number};
  return arrival;
}

void ByteStore::State::put(const std::string& key, const DiskEntry& entry) {
  if (!disk || !disk->put(key, entry)) ++not_kept;
}

/// What a transfer's outcome says of the file, kept on disk where that makes sense.
std::variant<File, Error> ByteStore::State::take(const Request& request, Outcome outcome) {
  if (!outcome) {
    if (outcome.error().code != ErrorCode::not_found) return outcome.error();
    put(request.key, {{}, true, {}, {}, System::now() + options.negative_lifetime});
    return File{};
  }
  const System::time_point expires = System::now() + outcome->max_age.value_or(options.default_lifetime);
  if (outcome->not_modified) {
    std::optional<DiskEntry> old = disk ? disk->find(request.key) : std::nullopt;
    if (!old || old->missing) return Error{ErrorCode::unavailable, fmt::format("{}: was dropped from the cache just now", public_part(request.url))};
    disk->renew(request.key, expires);
    return file_of(std::move(*old));
  }
  if (request.refuse) {
    if (auto why = request.refuse(outcome->body)) return Error{ErrorCode::unavailable, std::move(*why)};
  }
  if (outcome->etag.empty() && !outcome->last_modified.empty()) outcome->etag = kModified + outcome->last_modified;
  DiskEntry entry{std::move(outcome->body), false, std::move(outcome->etag), std::move(outcome->content_type), expires, outcome->whole_bytes};
  put(request.key, entry);
  return file_of(std::move(entry));
}

void ByteStore::State::arrived(const Request& request, std::uint64_t number, Outcome outcome) {
  const bool cancelled = !outcome && outcome.error().code == ErrorCode::cancelled;
  const Steady::duration least_pause = std::min<std::chrono::seconds>(outcome.retry_after.value_or(std::chrono::seconds(0)), kLongestRetryAfter);
  std::shared_ptr<Arrival> arrival;  // its deleter takes the mutex: it has to outlive the lock
  std::variant<File, Error> content = Error{};
  if (!cancelled) content = take(request, std::move(outcome));
  {
    std::lock_guard lock(mutex);
    const auto flying = flights.find(request.key);
    if (flying != flights.end() && flying->second.number == number) {
      arrival = flying->second.arrival.lock();
      flights.erase(flying);
    }
    if (!cancelled) {
      if (auto* error = std::get_if<Error>(&content)) {
        keep_failure(request.key, std::move(*error), least_pause);
      } else {
        const bool missing = !std::get<File>(content).bytes;
        keep(request.key, std::move(content), missing ? Steady::duration(options.negative_lifetime) : Steady::duration(options.default_lifetime));
      }
    }
  }
  if (arrival) arrival->end();
}

ByteStore::ByteStore(const StoreOptions& options) : state_(std::make_shared<State>(options)) {
  if (!options.disk_file.empty()) {
    auto disk = DiskCache::open(options.disk_file, options.disk_bytes);
    if (disk) state_->disk = std::move(*disk);
    else log::warning(disk.error().message + "; what is fetched is not kept");
  }
  if (!options.offline) state_->fetcher = std::make_unique<Fetcher>(options.fetch);
}

ByteStore::~ByteStore() { state_->fetcher.reset(); }

Asked ByteStore::ask(const Request& request, double gain) {
  State& s = *state_;
  {
    std::lock_guard lock(s.mutex);
    if (auto found = s.find(request.key)) return std::move(*found);
  }
  Request wanted = request;
  if (s.disk) {
    if (std::optional<DiskEntry> entry = s.disk->find(request.key)) {
      const bool fresh = s.options.offline || System::now() < entry->expires;
      if (fresh) {
        const bool missing = entry->missing;
        File file = file_of(std::move(*entry));
        std::lock_guard lock(s.mutex);
        s.keep(request.key, file, missing ? Steady::duration(s.options.negative_lifetime) : Steady::duration(s.options.default_lifetime));
        return file;
      }
      if (!entry->missing && !entry->etag.starts_with(kModified)) wanted.etag = entry->etag;
    }
  }
  if (!s.fetcher) return Error{ErrorCode::unavailable, fmt::format("{}: is not in the disk cache, and --offline fetches nothing", public_part(request.url))};
  std::lock_guard lock(s.mutex);
  if (auto found = s.find(request.key)) return std::move(*found);  // someone else was faster
  return s.begin(wanted, gain);
}

void ByteStore::reject(const std::string& key, const std::string& why) {
  State& s = *state_;
  if (s.disk) s.disk->remove(key);
  std::lock_guard lock(s.mutex);
  s.keep_failure(key, Error{ErrorCode::unavailable, why});
}

FetchStats ByteStore::stats() const {
  FetchStats stats = state_->fetcher ? state_->fetcher->stats() : FetchStats{};
  stats.not_kept = state_->not_kept;
  return stats;
}
std::size_t ByteStore::disk_bytes() const { return state_->disk ? state_->disk->bytes() : 0; }

}  // namespace tellurion::fetch
