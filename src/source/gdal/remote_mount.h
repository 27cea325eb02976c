// A file on a server as a file of GDAL, whose own network access stays off.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <gdal_priv.h>

#include "base/result.h"
#include "fetch/remote_file.h"
#include "source/raster_source.h"

namespace tellurion::source {

inline constexpr const char* kRemotePrefix = "/vsitellurion/";  ///< of paths that mean something only as long as a mount lives

/// The file in chunks, for what cannot be asked for before it is needed: a TIFF's directories. Shared by all of the file's readers.
/// Thread-safe.
class RemoteChunks {
 public:
  static constexpr std::size_t kChunkBytes = 65536;  ///< RemoteFile::open takes the first one

  explicit RemoteChunks(std::shared_ptr<const fetch::RemoteFile> file) : file_(std::move(file)) {}

  const fetch::RemoteFile& file() const { return *file_; }
  /// Bytes that have come with chunks; null if some of them have not.
  std::shared_ptr<const std::string> kept(const fetch::ByteRange& part) const;
  /// The chunk, which is waited for, or, with `awaited`, asked for: its arrival is added there. Errors: as RemoteFile's; pending.
  Result<std::shared_ptr<const std::string>> chunk(std::uint64_t index, Awaited* awaited) const;

 private:
  Result<std::shared_ptr<const std::string>> fetched(const fetch::ByteRange& part, Awaited* awaited) const;

  std::shared_ptr<const fetch::RemoteFile> file_;
  mutable std::mutex mutex_;  ///< guards what follows
  mutable std::map<std::uint64_t, std::shared_ptr<const std::string>> kept_;
};

/// One thread's view of the file under a path of GDAL's virtual file system /vsitellurion/, as long as this lives.
/// Not thread-safe.
class RemoteMount {
 public:
  /// Reads wait for what has not come; with `awaited`, which outlives this, they fail as pending and put the arrivals there.
  explicit RemoteMount(std::shared_ptr<const RemoteChunks> chunks, Awaited* awaited = nullptr);
  ~RemoteMount();
  RemoteMount(const RemoteMount&) = delete;
  RemoteMount& operator=(const RemoteMount&) = delete;

  const std::string& path() const { return path_; }
  const RemoteChunks& chunks() const;
  const fetch::RemoteFile& file() const { return chunks().file(); }

  /// Bytes that GDAL will read next, so that it need not wait for them.
  void put(std::uint64_t offset, std::shared_ptr<const std::string> bytes);
  void drop_pieces();
  /// Why bytes could not be read. GDAL may have taken their absence for something else: what was opened from this path must
  /// be opened anew, from another mount.
  const std::optional<Error>& failure() const;

  struct State;

 private:
  std::shared_ptr<State> state_;
  std::string path_;
};

/// A data set in a remote file, for one thread.
struct RemoteDataset {
  std::unique_ptr<RemoteMount> mount;  ///< outlives the data set
  GDALDatasetUniquePtr dataset;
};

/// Opens a GeoTIFF; its directories are waited for, or asked for (see RemoteMount). Errors: as RemoteFile's; pending; corrupt,
/// unsupported (no GeoTIFF), naming the file.
Result<RemoteDataset> open_remote_tiff(std::shared_ptr<const RemoteChunks> chunks, Awaited* awaited = nullptr);

}  // namespace tellurion::source
