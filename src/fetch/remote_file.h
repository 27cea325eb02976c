// A file on a server that is read in parts. Parts of two versions of it are never mixed.
// Thread-safe.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "fetch/byte_store.h"

namespace tellurion::fetch {

class RemoteFile {
 public:
  /// Asks for the first `head_bytes` and waits for them, at most for `patience`. Errors: as Fetcher's; not_found; unavailable.
  static Result<std::shared_ptr<const RemoteFile>> open(std::shared_ptr<ByteStore> store, const std::string& url, std::vector<std::string> headers,
                                                        std::size_t head_bytes, std::chrono::milliseconds patience);

  const std::string& name() const { return name_; }             ///< of the file, without credentials
  std::uint64_t size() const { return size_; }                  ///< bytes
  const std::shared_ptr<const std::string>& head() const { return head_; }
  std::string revision() const;                                 ///< another one when the file is another

  /// The bytes of `part`, which lies within the file, or their arrival. Errors: as ByteStore's; corrupt (beyond the file's
  /// end); unavailable (the file on the server is another one now).
  Asked ask(const ByteRange& part, double gain) const;
  /// The same, waited for.
  Result<std::shared_ptr<const std::string>> wait_for(const ByteRange& part, std::chrono::milliseconds patience) const;
  /// The bytes proved worthless: they are forgotten, with the head if they belong to it.
  void reject(const ByteRange& part, const std::string& why) const;

 private:
  RemoteFile() = default;
  Request request_for(const ByteRange& part) const;

  std::shared_ptr<ByteStore> store_;
  std::string url_;
  std::vector<std::string> headers_;
  std::string name_;
  std::string head_key_;
  std::shared_ptr<const std::string> head_;
  std::string etag_;
  std::uint64_t size_ = 0;
};

}  // namespace tellurion::fetch
