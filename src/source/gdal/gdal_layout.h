// What a GDAL data set holds and how it is to be read: found once at opening, then shared by all readers.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gdal_priv.h>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "source/gdal/gdal_source.h"
#include "source/gdal/remote_mount.h"
#include "source/proj/pixel_mapping.h"
#include "source/raster_source.h"

namespace tellurion::source {

/// Where the samples of a level come from.
struct LevelPlan {
  int overview = -1;    ///< the file's overview to read; -1: the full raster
  bool direct = false;  ///< the overview is the level; else it is averaged down to it
};

struct HeightPlan {
  std::optional<double> no_data;
  bool int16_voids = false;   ///< no value is declared: -32768 and -32767 are taken as voids
  double scale = 1.0;         ///< metres = (sample * scale + offset) * unit
  double offset = 0.0;
  double unit = 1.0;
  double limit_metres = 0.0;  ///< what is higher or deeper is no data
  bool from_centre = false;   ///< the raster's numbers are distances from the body's centre: heights are above the sphere of its equatorial radius
};

enum class ColourModel { grey, palette, rgb, cmyk };

struct ColourPlan {
  ColourModel model = ColourModel::grey;
  std::vector<int> bands;  ///< 1-based: one, three or four of them
  int alpha_band = 0;      ///< 0: none
  std::vector<std::optional<double>> no_data;              ///< of `bands`; a pixel is void where all of them have theirs
  std::vector<std::array<std::uint8_t, 4>> palette;        ///< premultiplied
  std::optional<double> full_scale;                        ///< what is 255; nothing: found from the samples
};

/// Immutable after opening.
struct GdalLayout {
  GdalOptions options;
  std::string file;      ///< what readers open: the raster itself, or its unpacked copy
  std::shared_ptr<const RemoteChunks> remote;  ///< that instead, if it lies on a server
  geo::Ellipsoid world;
  RasterDescription description;
  Georeference georeference;
  std::vector<LevelPlan> levels;
  HeightPlan heights;
  ColourPlan colours;
  std::string vertical;  ///< what VerticalDatum::create takes; empty: heights are above the ellipsoid already
  std::string revision;
};

/// Finds out all that needs no projection. Errors: unsupported, invalid_argument; naming the file.
Result<GdalLayout> inspect(GDALDataset& dataset, const GdalOptions& options, const geo::Ellipsoid& world);

}  // namespace tellurion::source
