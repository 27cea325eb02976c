#include "prepare/write_whole.h"

#include <fstream>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

namespace tellurion::prepare {

Result<void> write_whole(const std::filesystem::path& file, std::string_view content) {
  std::filesystem::path part = file;
  part += fmt::format(".{}.part", getpid());
  std::ofstream stream(part, std::ios::binary);
  stream << content;
  stream.close();
  std::error_code error;
  if (stream) std::filesystem::rename(part, file, error);
  if (stream && !error) return {};
  std::error_code ignored;
  std::filesystem::remove(part, ignored);
  return {ErrorCode::unavailable, fmt::format("{} cannot be written; is the folder writable, and is there room on the disk? The same command goes on from there", file.string())};
}

}  // namespace tellurion::prepare
