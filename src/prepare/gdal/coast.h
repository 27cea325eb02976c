// A file of land, and the sea that is cut away off its coast.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <ogr_spatialref.h>

#include "base/result.h"
#include "prepare/open_sea.h"
#include "prepare/plan.h"

namespace tellurion::prepare {

struct DestroyTransformation {
  void operator()(OGRCoordinateTransformation* transformation) const { OGRCoordinateTransformation::DestroyCT(transformation); }
};

/// Land out of files.
struct Coast {
  std::string revision;  ///< what it depends on
  Shore shore;

  /// All polygons that GDAL finds in `paths`, or GSHHG's shorelines as GMT packs them, for rasters in `crs`; a file is a land.
  /// Errors: not_found, unsupported, corrupt; all name the file and what to do.
  static Result<std::shared_ptr<const Coast>> create(const std::vector<std::string>& paths, const std::string& crs);
};

/// Cuts the sea out of samples. One object for each thread.
class SeaCutter {
 public:
  static Result<SeaCutter> create(std::shared_ptr<const Coast> coast, const OutputPlan& plan, double metres);

  /// `samples` are those of `box`: what lies in the sea beyond the distance becomes void or transparent.
  void cut(const PixelBox& box, Samples& samples) const;

 private:
  std::shared_ptr<const Coast> coast_;
  const OutputPlan* plan_ = nullptr;
  double metres_ = 0.0;
  double radians_ = 0.0;  ///< of a unit of angle
  std::unique_ptr<OGRCoordinateTransformation, DestroyTransformation> to_geographic_;
};

}  // namespace tellurion::prepare
