// One input of a preparation: what it holds, where it lies, and how it comes onto the output's grid.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include "base/result.h"
#include "prepare/gdal/memory_files.h"
#include "prepare/ingest.h"
#include "prepare/plan.h"

namespace tellurion::prepare {

constexpr double kOwnVoid = -32768.0;  ///< where voids need a value and no input names one

/// A rectangle in pixels of the output.
struct Rectangle {
  double x = 0.0, y = 0.0, width = 0.0, height = 0.0;
};

struct Input {
  std::string path;
  std::string source;         ///< what is read in its place: itself, or a virtual raster of it
  int columns = 0;
  int rows = 0;
  int block_x = 0;
  int block_y = 0;
  bool point_samples = false;
  OGRSpatialReference crs;
  std::array<double, 6> transform{};
  IngestKind kind = IngestKind::height;
  SampleType type = SampleType::f32;
  std::vector<BandAbout> bands;
  std::optional<double> no_data;
  int colours = 0;            ///< bands without alpha
  int alpha_band = 0;         ///< 0: none
  bool has_mask = false;      ///< beside the bands, for all of them
  double scale_to_byte = 1.0; ///< of pictures of fewer than 8 bits
  bool north_up = true;
  std::string revision;
  bool warped = false;
  double fineness = 1.0;      ///< output pixels for one of its own, where it is warped
  Rectangle place;            ///< on the output's grid
};

struct Extent {
  double west = 0.0, south = 0.0, east = 0.0, north = 0.0;
  double pixel_x = 0.0, pixel_y = 0.0;
};

Error unsupported(const Input& input, const std::string& what);

/// Names, sizes and times of all files that a data set is made of.
std::string revision_of(GDALDataset& dataset, const std::string& path);

/// Opens and looks at it; what has to be made to read it comes into `files`. Errors: as `ingest`.
Result<Input> inspect(const std::string& path, const IngestOptions& options, MemoryFiles& files);

/// Where an input lies in the output's CRS, and how fine it is there. Errors: unsupported.
Result<Extent> extent_in(const Input& input, const std::string& crs);

/// Puts in its place one of the output's grid, in the rectangle `place`, computed while it is read. Errors: as `ingest`.
Result<void> warp(Input& input, const IngestOptions& options, const OutputPlan& plan, MemoryFiles& files);

}  // namespace tellurion::prepare
