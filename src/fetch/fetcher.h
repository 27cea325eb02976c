// Transfers over HTTP, many at a time, on one network thread (curl's multi interface). The only door to the network.
// Thread-safe.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "fetch/arrival.h"
#include "fetch/transfer.h"

namespace tellurion::fetch {

struct FetchOptions {
  int most_transfers = 32;           ///< at a time, in all
  int most_per_host = 12;            ///< of them to one host; over HTTP/2, where they share a connection, as many as in all
  int most_attempts = 4;             ///< of one transfer
  std::chrono::milliseconds first_pause{250};     ///< before the second attempt; doubled for each further one, and jittered
  std::chrono::milliseconds connect_timeout{10'000};
  std::chrono::milliseconds stall_timeout{15'000};  ///< without a byte
  std::chrono::seconds longest_pause{60};         ///< of what a server asks for by Retry-After; with a longer one the transfer fails at once
  std::size_t most_bytes = std::size_t{64} << 20; ///< of a body; larger ones fail
};

struct FetchStats {
  std::int64_t started = 0;    ///< requests sent, attempts included
  std::int64_t finished = 0;   ///< transfers answered
  std::int64_t cancelled = 0;
  std::int64_t failed = 0;
  std::int64_t bytes = 0;      ///< of bodies, but of errors', as they come over the network: of transfers under way as well
  std::int64_t not_kept = 0;   ///< answers of servers that the disk cache could not take, or for which there is none; of a ByteStore
  int waiting = 0;
  int in_flight = 0;
};

class Fetcher {
 public:
  /// Names a transfer from its start to its end.
  using Ticket = std::uint64_t;

  explicit Fetcher(const FetchOptions& options = {});
  /// Ends all transfers as cancelled.
  ~Fetcher();
  Fetcher(const Fetcher&) = delete;
  Fetcher& operator=(const Fetcher&) = delete;

  /// Begins as soon as the limits allow, of those that may begin the greatest `gain` first. `done` is called once, on the network
  /// thread; it must be quick and may start further transfers.
  Ticket start(Request request, Gain gain, Done done);
  /// Ends the transfer, in flight or not, as cancelled. Nothing if it is over.
  void cancel(Ticket ticket);

  FetchStats stats() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tellurion::fetch
