#include "source/tiles/file_parts.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "fetch/remote_file.h"

namespace tellurion::source {
namespace {

/// Bytes `part` of an open file; fewer if they cannot be read.
std::string read_part(int file, const fetch::ByteRange& part) {
  std::string bytes(static_cast<std::size_t>(part.length), '\0');
  std::size_t got = 0;
  while (got < bytes.size()) {
    const ssize_t count = pread(file, bytes.data() + got, bytes.size() - got, static_cast<off_t>(part.offset + got));
    if (count <= 0) break;
    got += static_cast<std::size_t>(count);
  }
  bytes.resize(got);
  return bytes;
}

class LocalParts final : public FileParts {
 public:
  LocalParts(int file, std::string name, std::uint64_t size, std::string revision, std::size_t head_bytes)
      : file_(file), name_(std::move(name)), size_(size), revision_(std::move(revision)),
        head_(read_part(file, {0, std::min<std::uint64_t>(head_bytes, size)})) {}
  ~LocalParts() override { close(file_); }
  LocalParts(const LocalParts&) = delete;
  LocalParts& operator=(const LocalParts&) = delete;

  fetch::Asked ask(const fetch::ByteRange& part, double) const override {
    constexpr std::uint64_t kMostBytes = std::uint64_t{64} << 20;
    if (part.offset > size_ || part.length > size_ - part.offset)
      return Error{ErrorCode::corrupt, fmt::format("{}: its index names bytes {} to {}, but it has {}; it is cut off or damaged", name_, part.offset,
                                                   part.offset + part.length, size_)};
    if (part.length > kMostBytes) return Error{ErrorCode::exhausted, fmt::format("{}: holds a part of {} MB; at most 64 MB are read", name_, part.length >> 20)};
    std::string bytes = read_part(file_, part);
    if (bytes.size() < part.length) return Error{ErrorCode::unavailable, fmt::format("{}: cannot be read any more; has it changed?", name_)};
    return fetch::File{std::make_shared<const std::string>(std::move(bytes)), {}, {}};
  }
  Result<void> wait_for(const fetch::ByteRange&, std::chrono::milliseconds) const override { return {}; }
  void reject(const fetch::ByteRange&, const std::string&) const override {}
  const std::string& name() const override { return name_; }
  const std::string& head() const override { return head_; }
  std::uint64_t size() const override { return size_; }
  std::string revision() const override { return revision_; }

 private:
  int file_;
  std::string name_;
  std::uint64_t size_;
  std::string revision_;
  std::string head_;
};

class RemoteParts final : public FileParts {
 public:
  explicit RemoteParts(std::shared_ptr<const fetch::RemoteFile> file) : file_(std::move(file)) {}

  fetch::Asked ask(const fetch::ByteRange& part, double gain) const override { return file_->ask(part, gain); }
  Result<void> wait_for(const fetch::ByteRange& part, std::chrono::milliseconds patience) const override {
    const auto there = file_->wait_for(part, patience);
    return there ? Result<void>() : Result<void>(there.error());
  }
  void reject(const fetch::ByteRange& part, const std::string& why) const override { file_->reject(part, why); }
  const std::string& name() const override { return file_->name(); }
  const std::string& head() const override { return *file_->head(); }
  std::uint64_t size() const override { return file_->size(); }
  std::string revision() const override { return file_->revision(); }

 private:
  std::shared_ptr<const fetch::RemoteFile> file_;
};

}  // namespace

Result<std::unique_ptr<const FileParts>> open_local_parts(const std::filesystem::path& file, std::size_t head_bytes) {
  const std::string name = file.string();
  std::error_code failure;
  if (!std::filesystem::exists(file, failure)) return Error{ErrorCode::not_found, fmt::format("{}: no such file", name)};
  if (!std::filesystem::is_regular_file(file, failure)) return Error{ErrorCode::unsupported, fmt::format("{}: is no file", name)};
  const Error closed{ErrorCode::unavailable, fmt::format("{}: cannot be opened; may it be read?", name)};
  const auto size = std::filesystem::file_size(file, failure);
  if (failure) return closed;
  const auto written = std::filesystem::last_write_time(file, failure).time_since_epoch().count();
  if (failure) return closed;
  const int opened = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (opened < 0) return closed;
  return std::unique_ptr<const FileParts>(std::make_unique<LocalParts>(opened, name, size, fmt::format("{}|{} {}", name, size, written), head_bytes));
}

Result<std::unique_ptr<const FileParts>> open_remote_parts(std::shared_ptr<fetch::ByteStore> store, const std::string& url, const std::vector<std::string>& headers,
                                                           std::size_t head_bytes, std::chrono::milliseconds patience) {
  auto file = fetch::RemoteFile::open(std::move(store), url, headers, head_bytes, patience);
  if (!file) return file.error();
  return std::unique_ptr<const FileParts>(std::make_unique<RemoteParts>(std::move(*file)));
}

}  // namespace tellurion::source
