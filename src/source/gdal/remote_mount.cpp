#include "source/gdal/remote_mount.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <utility>
#include <variant>

#include <cpl_conv.h>
#include <cpl_vsi_virtual.h>
#include <fmt/format.h>

#include "source/gdal/gdal_runtime.h"

namespace tellurion::source {
namespace {

constexpr std::chrono::milliseconds kPatience{30'000};  ///< for a chunk
constexpr std::size_t kMostKeptChunks = 256;
constexpr double kIndexGain = 0.0;  ///< more than that of any block, of which nothing is known without it

}  // namespace

Result<std::shared_ptr<const std::string>> RemoteChunks::fetched(const fetch::ByteRange& part, Awaited* awaited) const {
  if (!awaited) return file_->wait_for(part, kPatience);
  fetch::Asked asked = file_->ask(part, kIndexGain);
  if (auto* failure = std::get_if<Error>(&asked)) return std::move(*failure);
  if (auto* arrival = std::get_if<std::shared_ptr<fetch::Arrival>>(&asked)) {
    awaited->push_back(std::move(*arrival));
    return Error{ErrorCode::pending, file_->name()};
  }
  auto& bytes = std::get<fetch::File>(asked).bytes;
  if (!bytes) return Error{ErrorCode::unavailable, fmt::format("{}: has gone from the server", file_->name())};
  return std::move(bytes);
}

Result<std::shared_ptr<const std::string>> RemoteChunks::chunk(std::uint64_t index, Awaited* awaited) const {
  const std::uint64_t offset = index * kChunkBytes;
  if (offset == 0 && file_->head()->size() == std::min<std::uint64_t>(kChunkBytes, file_->size())) return file_->head();
  {
    std::lock_guard lock(mutex_);
    if (const auto found = kept_.find(index); found != kept_.end()) return found->second;
  }
  const std::uint64_t size = file_->size();
  auto bytes = fetched({offset, std::min<std::uint64_t>(kChunkBytes, size - std::min(offset, size))}, awaited);
  if (!bytes) return bytes;
  std::lock_guard lock(mutex_);
  if (kept_.size() >= kMostKeptChunks) kept_.clear();  // an index of a hundred thousand blocks has some twenty
  kept_.emplace(index, *bytes);
  return bytes;
}

std::shared_ptr<const std::string> RemoteChunks::kept(const fetch::ByteRange& part) const {
  std::string bytes;
  std::lock_guard lock(mutex_);
  while (bytes.size() < part.length) {
    const std::uint64_t at = part.offset + bytes.size();
    const auto found = kept_.find(at / kChunkBytes);
    const std::string* chunk = at < file_->head()->size() ? file_->head().get() : found != kept_.end() ? found->second.get() : nullptr;
    const auto within = static_cast<std::size_t>(at % kChunkBytes);
    if (!chunk || within >= chunk->size()) return nullptr;
    bytes.append(*chunk, within, static_cast<std::size_t>(part.length) - bytes.size());
  }
  return std::make_shared<const std::string>(std::move(bytes));
}

struct RemoteMount::State {
  std::shared_ptr<const RemoteChunks> chunks;
  Awaited* awaited = nullptr;
  std::map<std::uint64_t, std::shared_ptr<const std::string>> pieces;  ///< by their offset
  std::optional<Error> failure;

  /// Copies what one piece or chunk has from `offset` on; 0 if it cannot be had.
  std::size_t read(std::uint64_t offset, char* out, std::size_t count);
};

std::size_t RemoteMount::State::read(std::uint64_t offset, char* out, std::size_t count) {
  const auto copy = [&](const std::string& bytes, std::uint64_t from) {
    const std::size_t length = std::min<std::size_t>(count, bytes.size() - static_cast<std::size_t>(from));
    std::memcpy(out, bytes.data() + from, length);
    return length;
  };
  if (auto after = pieces.upper_bound(offset); after != pieces.begin()) {
    const auto& [begin, bytes] = *std::prev(after);
    if (offset - begin < bytes->size()) return copy(*bytes, offset - begin);
  }
  const Result<std::shared_ptr<const std::string>> chunk = chunks->chunk(offset / RemoteChunks::kChunkBytes, awaited);
  if (!chunk) {
    failure = chunk.error();
    return 0;
  }
  const std::uint64_t within = offset % RemoteChunks::kChunkBytes;
  return within < (*chunk)->size() ? copy(**chunk, within) : 0;
}

namespace {

class RemoteHandle final : public VSIVirtualHandle {
 public:
  explicit RemoteHandle(std::shared_ptr<RemoteMount::State> state) : state_(std::move(state)) {}

  int Seek(vsi_l_offset offset, int whence) override {
    at_end_ = false;
    if (whence == SEEK_SET) place_ = offset;
    else if (whence == SEEK_CUR) place_ += offset;
    else place_ = size() + offset;
    return 0;
  }
  vsi_l_offset Tell() override { return place_; }
  size_t Read(void* buffer, size_t size_of_one, size_t count) override {
    if (size_of_one == 0 || count == 0) return 0;
    const std::uint64_t left = size() - std::min<std::uint64_t>(place_, size());
    const std::size_t wanted = count > left / size_of_one ? static_cast<std::size_t>(left) : size_of_one * count;
    at_end_ = wanted < size_of_one * count;
    std::size_t got = 0;
    while (got < wanted) {
      const std::size_t part = state_->read(place_, static_cast<char*>(buffer) + got, wanted - got);
      if (part == 0) break;
      got += part;
      place_ += part;
    }
    return got / size_of_one;
  }
  size_t Write(const void*, size_t, size_t) override { return 0; }
  int Eof() override { return at_end_ ? 1 : 0; }
  int Close() override { return 0; }

 private:
  std::uint64_t size() const { return state_->chunks->file().size(); }

  std::shared_ptr<RemoteMount::State> state_;
  std::uint64_t place_ = 0;
  bool at_end_ = false;
};

/// Knows the mounts by their paths; there is nothing else.
class RemoteFileSystem final : public VSIFilesystemHandler {
 public:
  std::string add(const std::shared_ptr<RemoteMount::State>& state) {
    std::lock_guard lock(mutex_);
    std::string path = fmt::format("{}{}.tif", kRemotePrefix, ++number_);
    mounts_[path] = state;
    return path;
  }
  void remove(const std::string& path) {
    std::lock_guard lock(mutex_);
    mounts_.erase(path);
  }

  VSIVirtualHandle* Open(const char* name, const char* access, bool, CSLConstList) override {
    const std::shared_ptr<RemoteMount::State> state = find(name);
    if (!state || std::strpbrk(access, "wa+") != nullptr) {
      errno = ENOENT;
      return nullptr;
    }
    return std::make_unique<RemoteHandle>(state).release();  // GDAL owns it
  }
  int Stat(const char* name, VSIStatBufL* stat, int) override {
    const std::shared_ptr<RemoteMount::State> state = find(name);
    *stat = {};
    if (!state) {
      errno = ENOENT;
      return -1;
    }
    stat->st_mode = S_IFREG;
    stat->st_size = static_cast<decltype(stat->st_size)>(state->chunks->file().size());
    return 0;
  }
  /// An empty list: nothing is looked for beside a file.
  char** ReadDirEx(const char*, int) override { return static_cast<char**>(CPLCalloc(1, sizeof(char*))); }
  bool IsLocal(const char*) override { return false; }

 private:
  std::shared_ptr<RemoteMount::State> find(const char* name) {
    std::lock_guard lock(mutex_);
    const auto found = mounts_.find(name);
    return found == mounts_.end() ? nullptr : found->second;
  }

  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<RemoteMount::State>> mounts_;
  std::uint64_t number_ = 0;
};

/// Installed once; GDAL owns it.
RemoteFileSystem& file_system() {
  static RemoteFileSystem* const installed = [] {
    RemoteFileSystem* made = std::make_unique<RemoteFileSystem>().release();
    VSIFileManager::InstallHandler(kRemotePrefix, made);
    return made;
  }();
  return *installed;
}

}  // namespace

RemoteMount::RemoteMount(std::shared_ptr<const RemoteChunks> chunks, Awaited* awaited) : state_(std::make_shared<State>()) {
  state_->chunks = std::move(chunks);
  state_->awaited = awaited;
  path_ = file_system().add(state_);
}

RemoteMount::~RemoteMount() { file_system().remove(path_); }

const RemoteChunks& RemoteMount::chunks() const { return *state_->chunks; }
void RemoteMount::put(std::uint64_t offset, std::shared_ptr<const std::string> bytes) { state_->pieces[offset] = std::move(bytes); }
void RemoteMount::drop_pieces() { state_->pieces.clear(); }
const std::optional<Error>& RemoteMount::failure() const { return state_->failure; }

Result<RemoteDataset> open_remote_tiff(std::shared_ptr<const RemoteChunks> chunks, Awaited* awaited) {
  prepare_gdal();
  const QuietErrors quiet;
  const std::string& name = chunks->file().name();
  RemoteDataset opened;
  opened.mount = std::make_unique<RemoteMount>(chunks, awaited);
  constexpr std::array<const char*, 2> kDrivers{"GTiff", nullptr};
  opened.dataset.reset(GDALDataset::Open(opened.mount->path().c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR, kDrivers.data()));
  if (opened.mount->failure()) return *opened.mount->failure();
  if (opened.dataset) return opened;
  chunks->file().reject({0, 1}, fmt::format("{}: could not be opened a moment ago", name));  // it may be mended on the server
  if (quiet.last().find("not recognized") != std::string::npos)
    return Error{ErrorCode::unsupported, fmt::format("{}: is no GeoTIFF; other files are read once they are downloaded: type = \"gdal\", path = ...", name)};
  std::string why = quiet.last();
  for (std::size_t at; (at = why.find(opened.mount->path())) != std::string::npos;) why.replace(at, opened.mount->path().size(), "it");
  return Error{ErrorCode::corrupt, fmt::format("{}: GDAL cannot read it: {}", name, why)};
}

}  // namespace tellurion::source
