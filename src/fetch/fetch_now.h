// Files that nothing can go on without: waited for.
// Thread-safe.
#pragma once

#include <chrono>
#include <functional>
#include <limits>
#include <string>

#include "base/result.h"
#include "fetch/byte_store.h"

namespace tellurion::fetch {

/// The gain of what someone waits for.
constexpr double kAwaitedGain = std::numeric_limits<double>::infinity();

/// What `ask` gives once it is no arrival: asked again at the end of each. Errors: its own; unavailable (no answer after
/// `patience`), naming `name`.
Result<File> wait_for_file(const std::function<Asked()>& ask, const std::string& name, std::chrono::milliseconds patience);

/// The file, once it is there. For what is read when a source is opened; tiles are never waited for.
/// Errors: not_found (the server says that there is no such file), unavailable (not there after `patience`), those of
/// ByteStore::ask; all name the URL without credentials.
Result<File> fetch_file_now(ByteStore& store, const Request& request, std::chrono::milliseconds patience);

/// Its bytes. Errors likewise.
Result<std::string> fetch_now(ByteStore& store, const Request& request, std::chrono::milliseconds patience);

}  // namespace tellurion::fetch
