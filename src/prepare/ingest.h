// Preparation of rasters: any number of them, larger than memory, become one Cloud Optimized GeoTIFF with overviews.
// The work is cut into chunks, each kept in a file of a work folder once it is done: whatever happens, it goes on from there,
// and several machines may share it. The result is the same byte for byte however it came about.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace tellurion::prepare {

enum class IngestKind { height, picture };

/// What is mended in what the inputs hold.
struct RepairOptions {
  int fill_voids = 0;                      ///< pixels: voids of heights of up to that width and height are filled smoothly; 0: none
  std::optional<std::string> fill_from{};  ///< a raster that covers all; what is missing comes from it, fitted to its surroundings
  std::optional<double> clouds{};          ///< what all colours show brighter than `fill_from` by more than this, in samples, is cloud and comes from there too
  std::vector<std::string> coasts{};       ///< up to 64 files of land, polygons or GMT's GSHHG, off which the sea is cut away beyond `sea_beyond`
  double sea_beyond = 0.0;                 ///< metres over ground

  bool fills() const { return fill_voids > 0 || fill_from; }
  bool any() const { return fills() || !coasts.empty(); }
};

struct IngestOptions {
  std::vector<std::string> inputs;       ///< what GDAL opens, or folders of it; where two overlap the finer one is on top, else the later one
  std::filesystem::path out;
  std::optional<IngestKind> kind{};      ///< nothing: told from the inputs
  std::optional<std::string> crs{};      ///< of the output; nothing: that of the first input
  std::optional<std::string> vertical{}; ///< what heights are above: "ellipsoid", "egm96" or a vertical CRS; nothing: what the inputs say
  std::optional<double> resolution{};    ///< of the output, in units of its CRS; nothing: the finest of the inputs
  std::optional<double> no_data{};       ///< of the inputs, over what they say
  std::string resampling = "bilinear";   ///< where grids differ, in GDAL's words
  std::optional<std::string> compress{}; ///< in GDAL's words; nothing: DEFLATE, for pictures JPEG, or WEBP with alpha
  RepairOptions repair{};
  int level = 6;
  int quality = 85;
  int block = 512;
  std::size_t memory_bytes = std::size_t{1} << 30;
  int workers = 1;
  std::optional<bool> error_table{};     ///< beside the output (surface/prepared_table.h); nothing: for heights too large to be scanned when they are shown
  int shard = 0;                         ///< this one of `shards`; of more than one none joins
  int shards = 1;
};

/// Of what is done now: chunks, then the error table.
struct IngestProgress {
  bool measures = false;    ///< the error table
  std::uint64_t pixels = 0;
  std::uint64_t all_pixels = 0;
  std::uint64_t bytes = 0;  ///< of samples read
};

struct IngestReport {
  int chunks = 0;         ///< of the whole work, or the shard
  int chunks_made = 0;    ///< the others were there already
  int width = 0;
  int height = 0;
  int levels = 0;
  bool joined = false;    ///< the output was written; else it was there already, or this is a shard
  bool measured = false;  ///< the error table likewise
  std::uint64_t file_bytes = 0;
};

/// Called from one thread at a time; false stops the work in an orderly way.
using IngestWatch = std::function<bool(const IngestProgress&)>;

/// The folder of what is done: the output's name and ".work".
std::filesystem::path work_folder(const std::filesystem::path& out);

/// Does what is not done yet. Errors, naming the file and what to do: invalid_argument, not_found, unsupported, corrupt (inputs),
/// unavailable (what cannot be written or read now), exhausted (the memory's bound is too small), cancelled.
Result<IngestReport> ingest(const IngestOptions& options, const IngestWatch& watch);

struct MergeOptions {
  std::vector<std::filesystem::path> folders{};  ///< nothing: the output's own work folder
  std::filesystem::path out;
  std::optional<bool> error_table{};     ///< as of IngestOptions
  std::size_t memory_bytes = std::size_t{1} << 30;
  int workers = 1;
};

/// Joins the chunks of all folders. Errors: as above; not_found, naming the shards' chunks that are missing.
Result<IngestReport> merge(const MergeOptions& options, const IngestWatch& watch);

}  // namespace tellurion::prepare
