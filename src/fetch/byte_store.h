// Files from servers: at hand in memory or on disk, or on their way. Each is fetched once, whoever asks for it.
// Thread-safe. Never waits for the network.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <variant>

#include "fetch/arrival.h"
#include "fetch/fetcher.h"
#include "fetch/transfer.h"

namespace tellurion::fetch {

struct StoreOptions {
  std::filesystem::path disk_file;                      ///< of the disk cache; empty: none
  std::size_t disk_bytes = std::size_t{4} << 30;
  std::size_t memory_bytes = std::size_t{16} << 20;     ///< of what has arrived and may be asked for soon
  bool offline = false;                                 ///< nothing is fetched; what the disk has counts, however old
  std::chrono::seconds negative_lifetime{3600};         ///< for how long "there is no such file" is believed
  std::chrono::seconds default_lifetime{7 * 86400};     ///< of files of which the server does not say it
  std::chrono::milliseconds pause_after_failure{500};  ///< before a file that failed for good is asked for again; doubled for every
                                                        ///< further failure, up to
  std::chrono::milliseconds longest_pause{60000};
  FetchOptions fetch;
};

/// What a server has under a key.
struct File {
  std::shared_ptr<const std::string> bytes;  ///< null: the server says that there is no such file
  std::string content_type;
  std::string etag{};                        ///< the version, if the server names it: its tag, else the date of its last change
  std::uint64_t whole_bytes = 0;             ///< of the whole file, where a part was asked for
};

/// A file; or why it cannot be had for now; or that it is on its way. Who lets go of an arrival does not want it any more:
/// when nobody holds it, the transfer is cancelled.
using Asked = std::variant<File, Error, std::shared_ptr<Arrival>>;

class ByteStore {
 public:
  /// Without a disk cache if it cannot be opened (a warning says so).
  explicit ByteStore(const StoreOptions& options);
  ~ByteStore();
  ByteStore(const ByteStore&) = delete;
  ByteStore& operator=(const ByteStore&) = delete;

  /// `gain`: of several, the greatest is fetched first. Errors: as Fetcher's.
  Asked ask(const Request& request, double gain = 0);

  /// The file proved worthless (an error page, a damaged image): it is forgotten and asked for again after a pause.
  void reject(const std::string& key, const std::string& why);

  FetchStats stats() const;
  std::size_t disk_bytes() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace tellurion::fetch
