// SQLite databases of any bytes, opened as MBTiles and as GeoPackages: shown or refused with a message.
// rooms: source
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

#include "source/gdal/gdal_source.h"
#include "source/tiles/tile_archive.h"

namespace {

void show(const tellurion::Result<std::unique_ptr<tellurion::source::RasterSource>>& source) {
  using namespace tellurion;
  if (!source) {
    if (source.error().message.empty()) std::abort();
    return;
  }
  const auto reader = (*source)->open_reader();
  if (!reader) return;
  const source::RasterDescription& about = (*source)->description();
  const auto level = static_cast<int>(about.levels.size()) - 1;
  const source::LevelSize& size = about.levels.back();
  const source::PixelWindow window{0, 0, std::min(size.width, 64), std::min(size.height, 64)};
  if (about.kind == source::SampleKind::height) (void)(*reader)->read_heights(level, window);
  else (void)(*reader)->read_colours(level, window);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion;
  static const bool ready = [] { return source::configure_gdal(16 << 20), true; }();
  (void)ready;
  const std::filesystem::path folder = std::filesystem::exists("/dev/shm") ? "/dev/shm" : std::filesystem::temp_directory_path();
  source::TileArchive archive;
  archive.file = folder / ("tellurion_fuzz_" + std::to_string(getpid()) + ".sqlite");
  std::ofstream(archive.file, std::ios::binary | std::ios::trunc).write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  show(source::open_mbtiles(archive, geo::kWgs84));
  show(source::open_geopackage(archive, geo::kWgs84));
  archive.kind = source::SampleKind::height;
  archive.vertical = "ellipsoid";
  show(source::open_geopackage(archive, geo::kWgs84));
  std::filesystem::remove(archive.file);
  return 0;
}
