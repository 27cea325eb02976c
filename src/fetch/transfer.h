// What is asked of a server, and what it said.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace tellurion::fetch {

/// Bytes offset ... offset + length - 1 of a file.
struct ByteRange {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;

  friend bool operator==(const ByteRange&, const ByteRange&) = default;
};

/// A file on a server, or a part of one.
struct Request {
  std::string url;                   ///< http: or https:; may hold credentials
  std::vector<std::string> headers;  ///< "Name: value"; may hold credentials
  std::string key{};                 ///< names the bytes in caches; holds no credentials
  std::string etag{};                ///< of bytes that are there already: only others are sent
  double expected_bytes = 0;         ///< see Arrival
  std::optional<ByteRange> range{};  ///< this part only, or what there is of it before the file's end
  /// What is wrong with bytes that the server calls good, such as an exception in place of a picture: a message; they are not kept.
  std::function<std::optional<std::string>(const std::string& bytes)> refuse{};
};

/// The end of a transfer that the server answered.
struct Reply {
  std::string body;
  std::string content_type;
  std::string etag;
  std::string last_modified{};                  ///< as the server wrote it
  std::optional<std::chrono::seconds> max_age;  ///< for how long the server says that it holds
  bool not_modified = false;                    ///< the bytes are still those of Request::etag; no body
  std::uint64_t whole_bytes = 0;                ///< of the whole file, where a part was asked for
};

/// Errors: not_found (204, 404, 410: there is no such file), unsupported (401, 403 and other refusals: asking again cannot
/// help; a server that does not give parts), unavailable (no connection, time-out, 429, 5xx: after all retries), exhausted (too large), cancelled.
/// Messages name the URL without its query, and what to do.
struct Outcome : Result<Reply> {
  using Result<Reply>::Result;
  std::optional<std::chrono::seconds> retry_after{};  ///< of a failure: for how long the server asks not to be asked again
};
using Done = std::function<void(Outcome)>;

/// `url` as messages show it: without user, password and query, which may be credentials.
std::string public_part(const std::string& url);

/// `url` without user, password and those parts of its query that look like credentials: fit for a key.
std::string without_credentials(const std::string& url);

}  // namespace tellurion::fetch
