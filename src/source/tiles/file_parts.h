// Parts of a file, here or on a server.
// Thread-safe.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "fetch/byte_store.h"
#include "fetch/transfer.h"

namespace tellurion::source {

class FileParts {
 public:
  virtual ~FileParts() = default;
  /// Errors: corrupt (beyond the file's end), unavailable; naming the file.
  virtual fetch::Asked ask(const fetch::ByteRange& part, double gain) const = 0;
  /// Waits until `ask` has an answer to give.
  virtual Result<void> wait_for(const fetch::ByteRange& part, std::chrono::milliseconds patience) const = 0;
  /// The bytes proved worthless: they are not kept.
  virtual void reject(const fetch::ByteRange& part, const std::string& why) const = 0;

  virtual const std::string& name() const = 0;      ///< without credentials
  virtual const std::string& head() const = 0;      ///< the first bytes, as many as were asked for at opening or as there are
  virtual std::uint64_t size() const = 0;           ///< bytes
  virtual std::string revision() const = 0;         ///< another one when the file is another
};

/// Errors: not_found, unavailable.
Result<std::unique_ptr<const FileParts>> open_local_parts(const std::filesystem::path& file, std::size_t head_bytes);
/// Errors: as fetch::RemoteFile's.
Result<std::unique_ptr<const FileParts>> open_remote_parts(std::shared_ptr<fetch::ByteStore> store, const std::string& url, const std::vector<std::string>& headers,
                                                           std::size_t head_bytes, std::chrono::milliseconds patience);

}  // namespace tellurion::source
