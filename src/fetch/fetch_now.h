// A file that nothing can go on without: waited for.
// Thread-safe.
#pragma once

#include <chrono>
#include <string>

#include "base/result.h"
#include "fetch/byte_store.h"

namespace tellurion::fetch {

/// The file's bytes, once they are there. For what is read when a source is opened; tiles are never waited for.
/// Errors: not_found (the server says that there is no such file), unavailable (not there after `patience`), those of
/// ByteStore::ask; all name the URL without credentials.
Result<std::string> fetch_now(ByteStore& store, const Request& request, std::chrono::milliseconds patience);

}  // namespace tellurion::fetch
