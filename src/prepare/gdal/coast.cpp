#include "prepare/gdal/coast.h"

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <numbers>
#include <optional>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include "prepare/gdal/gmt_shoreline.h"
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
  static Result<RingReader> create(const std::string& path, OGRSpatialReference from, const Geographic& to) {
    RingReader reader;
    reader.path_ = path;
    from.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    const source::QuietErrors quiet;
    reader.transformation_.reset(OGRCreateCoordinateTransformation(&from, &to.crs));
    if (!reader.transformation_) return {ErrorCode::unsupported, fmt::format("{}: its coordinate system does not go into the output's: {}", path, quiet.last())};
    if (from.IsGeographic()) reader.from_radians_ = from.GetAngularUnits();
    reader.to_radians_ = to.radians;
    return reader;
  }

  /// Errors: unsupported, if a point of it has no place.
  Result<void> add(const OGRGeometry& geometry, Land& land) const {
    const OGRwkbGeometryType type = wkbFlatten(geometry.getGeometryType());
    if (type == wkbPolygon) {
      for (const OGRLinearRing* ring : *geometry.toPolygon()) {
        const int count = ring->getNumPoints() - (ring->get_IsClosed() ? 1 : 0);
        std::vector<double> x, y;
        for (int i = 0; i < count; ++i) {
          x.push_back(ring->getX(i));
          y.push_back(ring->getY(i));
        }
        if (Result<void> added = add(std::move(x), std::move(y), land); !added) return added;
      }
    } else if (OGR_GT_IsSubClassOf(type, wkbGeometryCollection)) {
      for (const OGRGeometry* part : *geometry.toGeometryCollection()) {
        if (Result<void> added = add(*part, land); !added) return added;
      }
    }
    return {};
  }

  Result<void> add(std::vector<double> x, std::vector<double> y, Land& land) const {
    if (x.size() < 3) return {};
    const std::vector<double> before = x;
    if (!transformation_->Transform(static_cast<int>(x.size()), x.data(), y.data())) {
      return {ErrorCode::unsupported, fmt::format("{}: parts of it lie nowhere in the output's coordinate system; bring it to degrees first: ogr2ogr -t_srs EPSG:4326 OUT.gpkg IN", path_)};
    }
    Ring& ring = land.emplace_back();
    for (std::size_t i = 0; i < x.size(); ++i) {
      double longitude = x[i] * to_radians_;
      // A change of datum may wrap longitudes; a ring that goes past the 180th meridian shall go on there.
      if (from_radians_) longitude = *from_radians_ * before[i] + std::remainder(longitude - *from_radians_ * before[i], 2.0 * std::numbers::pi);
      ring.push_back({Radians(y[i] * to_radians_), Radians(longitude)});
    }
    return {};
  }

 private:
  std::string path_;
  std::unique_ptr<OGRCoordinateTransformation, DestroyTransformation> transformation_;
  std::optional<double> from_radians_;  ///< of its unit, if that is an angle
  double to_radians_ = 0.0;
};

Result<void> add_layer(const std::string& path, OGRLayer& layer, const Geographic& to, Land& land) {
  const source::QuietErrors quiet;
  if (layer.GetSpatialRef() == nullptr) return {ErrorCode::unsupported, fmt::format("{}: says no coordinate system; give it one: ogr2ogr -a_srs EPSG:4326 OUT.gpkg IN", path)};
  const Result<RingReader> reader = RingReader::create(path, *layer.GetSpatialRef(), to);
  if (!reader) return reader.error();
  for (const auto& feature : layer) {
    const OGRGeometry* geometry = feature->GetGeometryRef();
    if (geometry == nullptr) continue;
    const std::unique_ptr<OGRGeometry> straight(geometry->getLinearGeometry());
    if (Result<void> added = reader->add(*straight, land); !added) return added;
  }
  return {};
}

Result<void> add_gmt_shoreline(const std::string& path, GDALDataset& dataset, const Geographic& to, Land& land) {
  const Result<Land> shoreline = read_gmt_shoreline(dataset, path);
  if (!shoreline) return shoreline.error();
  const Result<RingReader> reader = RingReader::create(path, OGRSpatialReference(SRS_WKT_WGS84_LAT_LONG), to);
  if (!reader) return reader.error();
  for (const Ring& ring : *shoreline) {
    std::vector<double> x, y;
    for (const geo::LatLon& place : ring) {
      x.push_back(to_degrees(place.longitude).value);
      y.push_back(to_degrees(place.latitude).value);
    }
    if (Result<void> added = reader->add(std::move(x), std::move(y), land); !added) return added;
  }
  return {};
}

Result<Land> read_land(const std::string& path, const Geographic& to, std::string& revision) {
  const source::QuietErrors quiet;
  Land land;
  GDALDatasetUniquePtr dataset(GDALDataset::Open(path.c_str(), GDAL_OF_VECTOR | GDAL_OF_READONLY));
  if (dataset) {
    for (OGRLayer* layer : dataset->GetLayers()) {
      if (Result<void> added = add_layer(path, *layer, to, land); !added) return added.error();
    }
  } else {
    constexpr std::array<const char*, 2> kDrivers{"netCDF", nullptr};
    dataset.reset(GDALDataset::Open(path.c_str(), GDAL_OF_MULTIDIM_RASTER | GDAL_OF_READONLY, kDrivers.data()));
    if (!dataset) {
      std::error_code error;
      if (!std::filesystem::exists(path, error)) return {ErrorCode::not_found, fmt::format("{}: is not there", path)};
      return {ErrorCode::unsupported, fmt::format("{}: is damaged, or no file of polygons that GDAL opens; a coast is one of land, as Shapefile, GeoPackage or GeoJSON, or GSHHG of GMT (Debian: gmt-gshhg-low; binned_GSHHS_l.nc)", path)};
    }
    if (Result<void> added = add_gmt_shoreline(path, *dataset, to, land); !added) return added.error();
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
