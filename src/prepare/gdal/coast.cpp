#include "prepare/gdal/coast.h"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include "prepare/gdal/input.h"
#include "source/gdal/gdal_runtime.h"

namespace tellurion::prepare {
namespace {

struct Geographic {
  OGRSpatialReference crs;
  double radians = 0.0;  ///< of its unit of angle
  geo::Ellipsoid body;
};

Geographic geographic_of(const OGRSpatialReference& crs) {
  Geographic result;
  OGRSpatialReference horizontal = crs;
  horizontal.StripVertical();
  if (OGRSpatialReference* geographic = horizontal.CloneGeogCS(); geographic != nullptr) {
    result.crs = *geographic;
    geographic->Release();
  }
  result.crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  result.radians = result.crs.GetAngularUnits();
  result.body = {Metres(result.crs.GetSemiMajor()), Metres(result.crs.GetSemiMinor())};
  return result;
}

OGRSpatialReference crs_of(const OutputPlan& plan) {
  OGRSpatialReference crs;
  crs.importFromWkt(plan.crs.c_str());
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return crs;
}

/// Reads rings of polygons and turns them to latitude and longitude.
class RingReader {
 public:
  RingReader(OGRCoordinateTransformation* transformation, double radians, Land& land) : transformation_(transformation), radians_(radians), land_(land) {}

  /// False if a point of it has no place.
  bool add(const OGRGeometry& geometry) {
    const OGRwkbGeometryType type = wkbFlatten(geometry.getGeometryType());
    if (type == wkbPolygon) {
      for (const OGRLinearRing* ring : *geometry.toPolygon()) {
        if (!add_ring(*ring)) return false;
      }
    } else if (OGR_GT_IsSubClassOf(type, wkbGeometryCollection)) {
      for (const OGRGeometry* part : *geometry.toGeometryCollection()) {
        if (!add(*part)) return false;
      }
    }
    return true;
  }

 private:
  bool add_ring(const OGRLinearRing& ring) {
    const int count = ring.getNumPoints() - (ring.get_IsClosed() ? 1 : 0);
    if (count < 3) return true;
    std::vector<double> x(static_cast<std::size_t>(count)), y(x.size());
    for (int i = 0; i < count; ++i) {
      x[static_cast<std::size_t>(i)] = ring.getX(i);
      y[static_cast<std::size_t>(i)] = ring.getY(i);
    }
    if (!transformation_->Transform(count, x.data(), y.data())) return false;
    Ring& added = land_.emplace_back();
    for (std::size_t i = 0; i < x.size(); ++i) added.push_back({Radians(y[i] * radians_), Radians(x[i] * radians_)});
    return true;
  }

  OGRCoordinateTransformation* transformation_;
  double radians_;
  Land& land_;
};

Result<void> add_layer(const std::string& path, OGRLayer& layer, const Geographic& to, Land& land) {
  const source::QuietErrors quiet;
  if (layer.GetSpatialRef() == nullptr) return {ErrorCode::unsupported, fmt::format("{}: says no coordinate system; give it one: ogr2ogr -a_srs EPSG:4326 OUT.gpkg IN", path)};
  OGRSpatialReference from = *layer.GetSpatialRef();
  from.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  OGRCoordinateTransformation* transformation = OGRCreateCoordinateTransformation(&from, &to.crs);
  if (transformation == nullptr) return {ErrorCode::unsupported, fmt::format("{}: its coordinate system does not go into the output's: {}", path, quiet.last())};
  RingReader reader(transformation, to.radians, land);
  bool good = true;
  for (const auto& feature : layer) {
    const OGRGeometry* geometry = feature->GetGeometryRef();
    if (geometry == nullptr || !good) continue;
    const std::unique_ptr<OGRGeometry> straight(geometry->getLinearGeometry());
    good = reader.add(*straight);
  }
  OGRCoordinateTransformation::DestroyCT(transformation);
  if (!good) return {ErrorCode::unsupported, fmt::format("{}: parts of it lie nowhere in the output's coordinate system; bring it to degrees first: ogr2ogr -t_srs EPSG:4326 OUT.gpkg IN", path)};
  return {};
}

Result<Land> read_land(const std::string& path, const Geographic& to, std::string& revision) {
  const source::QuietErrors quiet;
  const GDALDatasetUniquePtr dataset(GDALDataset::Open(path.c_str(), GDAL_OF_VECTOR | GDAL_OF_READONLY));
  if (!dataset) {
    std::error_code error;
    if (!std::filesystem::exists(path, error)) return {ErrorCode::not_found, fmt::format("{}: is not there", path)};
    return {ErrorCode::unsupported, fmt::format("{}: is no file of polygons that GDAL opens; a coast is one of land, as Shapefile, GeoPackage or GeoJSON (of GSHHG: GSHHS_shp, level L1)", path)};
  }
  Land land;
  for (OGRLayer* layer : dataset->GetLayers()) {
    if (Result<void> added = add_layer(path, *layer, to, land); !added) return added.error();
  }
  if (land.empty()) return {ErrorCode::unsupported, fmt::format("{}: holds no polygons; a coast is a file of polygons of land", path)};
  revision += "|" + revision_of(*dataset, path);
  return land;
}

}  // namespace

Result<std::shared_ptr<const Coast>> Coast::create(const std::vector<std::string>& paths, const std::string& crs) {
  if (paths.size() > Shore::kMostLands) return {ErrorCode::invalid_argument, fmt::format("--coast takes up to {} files; put some together: ogrmerge.py -single -o OUT.gpkg IN...", Shore::kMostLands)};
  OGRSpatialReference output;
  output.importFromWkt(crs.c_str());
  const Geographic geographic = geographic_of(output);
  std::string revision;
  std::vector<Land> lands;
  for (const std::string& path : paths) {
    Result<Land> land = read_land(path, geographic, revision);
    if (!land) return land.error();
    lands.push_back(std::move(*land));
  }
  return std::make_shared<const Coast>(Coast{revision, Shore(geographic.body, lands)});
}

Result<SeaCutter> SeaCutter::create(std::shared_ptr<const Coast> coast, const OutputPlan& plan, double metres) {
  SeaCutter cutter;
  const OGRSpatialReference crs = crs_of(plan);
  const Geographic geographic = geographic_of(crs);
  const source::QuietErrors quiet;
  OGRSpatialReference horizontal = crs;
  horizontal.StripVertical();
  cutter.to_geographic_.reset(OGRCreateCoordinateTransformation(&horizontal, &geographic.crs));
  if (!cutter.to_geographic_) return {ErrorCode::unsupported, fmt::format("the output's coordinate system has no latitudes and longitudes: {}", quiet.last())};
  cutter.coast_ = std::move(coast);
  cutter.plan_ = &plan;
  cutter.metres_ = metres;
  cutter.radians_ = geographic.radians;
  return cutter;
}

void SeaCutter::cut(const PixelBox& box, Samples& samples) const {
  const source::QuietErrors quiet;
  const auto& t = plan_->transform;
  const PlaceOfPixel place = [&](double column, double row) -> std::optional<geo::LatLon> {
    double x = t[0] + column * t[1], y = t[3] + row * t[5];
    int good = 0;
    if (!to_geographic_->Transform(1, &x, &y, nullptr, &good) || !good || !std::isfinite(x) || !std::isfinite(y)) return std::nullopt;
    return geo::LatLon{Radians(y * radians_), Radians(x * radians_)};
  };
  const std::vector<std::uint8_t> open = open_sea(coast_->shore, place, box, metres_);
  const Samples blank = make_blank(plan_->layout, 1, 1);
  for (std::size_t i = 0; i < open.size(); ++i) {
    if (open[i] != 0) std::memcpy(samples.bytes.data() + i * blank.bytes.size(), blank.bytes.data(), blank.bytes.size());
  }
}

}  // namespace tellurion::prepare
