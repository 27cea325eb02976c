// What is to be made, decided before any sample is read: grid, format, and the chunks that it is made in.
// Thread-safe: values and pure functions. A plan says all that the joining needs: it works without the inputs.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "prepare/samples.h"

namespace tellurion::prepare {

/// How blocks are compressed, in the words of GDAL's GTiff driver.
struct Codec {
  std::string compress = "DEFLATE";
  int predictor = 1;  ///< 1: none, 2: differences, 3: of floats
  int level = 6;      ///< of DEFLATE and ZSTD
  int quality = 85;   ///< of JPEG and WEBP

  friend bool operator==(const Codec&, const Codec&) = default;
};

struct BandAbout {
  std::string colour;  ///< GDAL's name of its colour interpretation
  std::string description;
  std::string unit;
  double scale = 1.0;
  double offset = 0.0;

  friend bool operator==(const BandAbout&, const BandAbout&) = default;
};

struct OutputPlan {
  std::string crs;  ///< WKT
  std::array<double, 6> transform{};
  int width = 0;
  int height = 0;
  bool point_samples = false;
  SampleLayout layout;
  std::vector<BandAbout> bands;
  Codec codec;
  int block = 512;        ///< side
  int chunk_width = 0;    ///< multiples of `block` by powers of two
  int chunk_height = 0;
  /// Row by row, what each depends on; empty: no input lies there.
  std::vector<std::string> chunk_hashes{};

  int level_count() const;
  int chunk_columns() const { return (width + chunk_width - 1) / chunk_width; }
  int chunk_rows() const { return (height + chunk_height - 1) / chunk_height; }
  /// The levels that are made chunk by chunk are 0 to this one.
  int last_chunk_level() const;
  /// All of the plan but `chunk_hashes`, as text.
  std::string description() const;
};

/// A part of the grid that is made at once, in pixels of level 0.
struct Chunk {
  int index = 0;
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

Chunk chunk_of(const OutputPlan& plan, int index);

/// Sides of chunks. Where inputs are stored in rows of up to `stored_row_pixels`, chunks as wide save reading these again and again.
void choose_chunks(OutputPlan& plan, int stored_row_pixels);

/// The name of a chunk's file.
std::string chunk_file_name(const OutputPlan& plan, int index);

std::string to_text(const OutputPlan& plan);
/// Errors: corrupt.
Result<OutputPlan> plan_from_text(const std::string& text);

}  // namespace tellurion::prepare
