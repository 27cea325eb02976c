#include "base/gzip.h"

#include <algorithm>
#include <array>
#include <limits>

#include <fmt/format.h>
#include <zlib.h>

namespace tellurion {
namespace {

constexpr std::size_t kChunk = 32 * 1024;  ///< unpacked at a time
constexpr int kGzipOnly = 16 + MAX_WBITS;  ///< zlib's way of asking for gzip's header and trailer

/// zlib's state, freed at the end.
class Inflater {
 public:
  Inflater() : ready_(inflateInit2(&stream, kGzipOnly) == Z_OK) {}
  ~Inflater() {
    if (ready_) inflateEnd(&stream);
  }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
  bool ready() const { return ready_; }

  z_stream stream{};

 private:
  bool ready_;
};

}  // namespace

bool is_gzip(std::string_view bytes) { return bytes.starts_with("\x1f\x8b\x08"); }

Result<std::string> gunzip(std::string_view bytes, std::size_t most_bytes) {
  if (!is_gzip(bytes)) return Error{ErrorCode::corrupt, "is no gzip file"};
  if (bytes.size() > std::numeric_limits<uInt>::max()) return Error{ErrorCode::exhausted, "is a gzip file of more than 4 GB"};
  Inflater inflater;
  if (!inflater.ready()) return Error{ErrorCode::exhausted, "cannot be unpacked: no memory"};
  z_stream& stream = inflater.stream;
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());

  std::string unpacked;
  std::array<char, kChunk> chunk;
  for (;;) {
    stream.next_out = reinterpret_cast<Bytef*>(chunk.data());
    stream.avail_out = static_cast<uInt>(chunk.size());
    const int state = inflate(&stream, Z_NO_FLUSH);
    const std::size_t count = chunk.size() - stream.avail_out;
    if (count > most_bytes - unpacked.size())
      return Error{ErrorCode::exhausted, fmt::format("is a gzip file that holds more than {} bytes", most_bytes)};
    unpacked.append(chunk.data(), count);
    if (state == Z_STREAM_END) {
      if (stream.avail_in == 0) return unpacked;
      if (inflateReset(&stream) != Z_OK) return Error{ErrorCode::corrupt, "is a damaged gzip file"};  // another member follows
    } else if (state == Z_MEM_ERROR) {
      return Error{ErrorCode::exhausted, "cannot be unpacked: no memory"};
    } else if (state == Z_BUF_ERROR || (state == Z_OK && stream.avail_in == 0 && stream.avail_out > 0)) {
      return Error{ErrorCode::corrupt, "is a gzip file that ends too early"};
    } else if (state != Z_OK) {
      return Error{ErrorCode::corrupt, fmt::format("is a damaged gzip file{}{}", stream.msg != nullptr ? ": " : "", stream.msg != nullptr ? stream.msg : "")};
    }
  }
}

}  // namespace tellurion
