// Finds the errors of an ErrorTable: compares every sample of the data with the grids of all tiles above it.
// Jobs of workers, independent of one another; the table does not depend on how they are shared.
#pragma once

#include <map>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "surface/elevation_model.h"
#include "surface/error_table.h"

namespace tellurion::surface {

/// Rasters of more samples are not scanned; see make_facts for what is assumed of them.
inline constexpr double kMostScannedSamples = 100e6;

/// Whether the error table says something about a height layer.
bool is_scanned(const Layer& layer);

/// Whether a table beside the layer's raster is looked for (see prepared_table.h): where it is not scanned, or all there is.
bool wants_prepared_table(const SurfaceDescription& description, const Layer& layer);

/// The table ends where a tile's grid is at most this many samples of the data wide: grids from half of that on are finer than
/// the data, and their error can be told from the data round them when they are built (see error_between_samples).
inline constexpr double kFinestGridOfTable = 1.5;

/// Finest spacing of the samples of the enabled layers under a tile; infinite if none touches it.
double finest_spacing(std::span<const Layer> layers, const geo::TileKey& key);

/// What the numbers of every table depend on beside the data: tables of other rules are made again.
inline constexpr const char* kTableRules = "bound and common error, borders too, whole tiles";

/// Names all that a table depends on.
std::string table_revision(const SurfaceDescription& description);
/// Names all that the tables of scanned and prepared rasters depend on.
std::string errors_revision(const SurfaceDescription& description);

/// `description` with nothing but the height layers that are scanned: what the jobs' models are opened with.
SurfaceDescription scanned_part(const SurfaceDescription& description);

/// The subtrees to scan, in the order in which merge_scans wants their results.
std::vector<geo::TileKey> scan_jobs();

/// What a job finds: the subtree of `root`, and what its data say of the tiles above it.
struct SubtreeScan {
  geo::TileKey root;
  RecordTree tree{1};
  std::vector<TileRecord> above;  ///< of the ancestors, from level 0 on
};

/// Errors: those of reading, cancelled.
Result<SubtreeScan> scan_subtree(ElevationModel& model, const geo::TileKey& root, std::stop_token stop = {});

/// A job in parts, where it is too long for one: subtrees of its root, in the order in which JobMerge wants them.
std::vector<geo::TileKey> parts_of_job(const SurfaceDescription& description, const geo::TileKey& root);

/// What some data say of a tile above them; more may follow.
struct OpenRecord {
  TileRecord record;
  double worst = 0.0;    ///< largest distance so far between the data and the grid
  DeviationTally tally;  ///< of evenly spread places, by the area of the leaves
};

/// What a part finds.
struct PartScan {
  geo::TileKey root;
  RecordTree tree{1};
  std::vector<OpenRecord> above;  ///< of the ancestors, from level 0 on
};

/// Errors: as of scan_subtree.
Result<PartScan> scan_part(ElevationModel& model, const geo::TileKey& root, std::stop_token stop = {});

/// Puts the parts of a job together: what comes out is what scan_subtree finds of all at once.
class JobMerge {
 public:
  explicit JobMerge(const geo::TileKey& root);
  /// In the order of parts_of_job.
  void add(const PartScan& part);
  SubtreeScan finish() &&;

 private:
  geo::TileKey root_;
  RecordTree tree_{1};
  std::vector<OpenRecord> above_;          ///< ancestors of `root_`
  std::map<std::size_t, OpenRecord> inner_;  ///< nodes of the tree above the parts
};

/// One table out of the results of all jobs.
ErrorTable merge_scans(std::span<const SubtreeScan> scans);

}  // namespace tellurion::surface
