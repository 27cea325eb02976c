// The encoded blocks of a remote GeoTIFF, asked for before GDAL decodes them, so that no thread waits for them.
// Not thread-safe: belongs to a reader.
#pragma once

#include <vector>

#include <gdal_priv.h>

#include "base/result.h"
#include "fetch/transfer.h"
#include "source/gdal/remote_mount.h"
#include "source/raster_source.h"

namespace tellurion::source {

class RemoteBlocks {
 public:
  explicit RemoteBlocks(RemoteMount& mount) : mount_(mount) {}
  ~RemoteBlocks() { release(); }
  RemoteBlocks(const RemoteBlocks&) = delete;
  RemoteBlocks& operator=(const RemoteBlocks&) = delete;

  /// Puts the blocks that `window` of `band` touches into the mount; those that GDAL holds decoded stay there until `release`.
  /// Errors: pending (see take_awaited; all are asked for); as RemoteFile's.
  Result<void> bring(GDALRasterBand& band, const PixelWindow& window);
  Awaited take_awaited();
  /// What was brought is not needed any more.
  void release();
  /// What was brought cannot be decoded: it is not to be kept.
  void reject(const std::string& why);

 private:
  Result<void> bring_group(GDALRasterBand& band, int column, int first_row, int rows, double gain);

  RemoteMount& mount_;
  Awaited awaited_;
  std::vector<GDALRasterBlock*> locked_;    ///< decoded, in GDAL's cache
  std::vector<fetch::ByteRange> brought_;
};

}  // namespace tellurion::source
