#include "source/gdal/raster_index.h"

#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <cpl_conv.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_feature.h>
#include <ogr_geometry.h>
#include <ogr_spatialref.h>
#include <ogrsf_frmts.h>

#include "source/catalogue/list_maker.h"
#include "source/gdal/gdal_runtime.h"
#include "source/proj/projection.h"

namespace tellurion::source {
namespace {

/// A layer and its field that names the rasters.
struct Index {
  OGRLayer* layer = nullptr;
  int field = -1;
};

std::optional<Index> find_index(GDALDataset& dataset) {
  for (int i = 0; i < dataset.GetLayerCount(); ++i) {
    OGRLayer* layer = dataset.GetLayer(i);
    OGRFeatureDefn* fields = layer != nullptr ? layer->GetLayerDefn() : nullptr;
    if (fields == nullptr) continue;
    for (const char* name : {"location", "filename", "path"}) {
      const int field = fields->GetFieldIndex(name);
      if (field >= 0 && fields->GetFieldDefn(field)->GetType() == OFTString) return Index{layer, field};
    }
  }
  return std::nullopt;
}

/// The way from the layer's coordinates to places; nothing if it says no CRS.
Result<std::optional<Projection>> projection_of(OGRLayer& layer, const geo::Ellipsoid& world) {
  const OGRSpatialReference* said = layer.GetSpatialRef();
  if (said == nullptr || said->IsEmpty() || said->IsLocal()) return std::optional<Projection>();
  const char* called = said->GetName();
  if (called != nullptr && std::string_view(called).starts_with("Undefined ")) return std::optional<Projection>();  // of a GeoPackage
  const std::string wkt = wkt_of(*said);
  OGREnvelope extent;
  const bool has_extent = layer.GetExtent(&extent, TRUE) == OGRERR_NONE && std::isfinite(extent.MinX + extent.MaxX) && std::isfinite(extent.MinY + extent.MaxY);
  const glm::dvec2 centre = has_extent ? glm::dvec2(extent.MinX + extent.MaxX, extent.MinY + extent.MaxY) / 2.0 : glm::dvec2(0.0);
  Result<Projection> made = Projection::create(wkt, world, centre);
  if (!made) return made.error();
  return std::optional(std::move(made).value());
}

/// OGR gives coordinates of the layer's CRS east first, unless it was told otherwise.
bool is_north_first(OGRLayer& layer) {
  const OGRSpatialReference* crs = layer.GetSpatialRef();
  if (crs == nullptr) return false;
  const std::vector<int>& axes = crs->GetDataAxisToSRSAxisMapping();
  const bool crs_is_north_first = crs->EPSGTreatsAsLatLong() || crs->EPSGTreatsAsNorthingEasting();
  return crs_is_north_first && axes.size() >= 2 && axes[0] == 1;
}

void add_outline(const OGRPolygon& polygon, std::vector<Outline>& outlines) {
  const OGRLinearRing* ring = polygon.getExteriorRing();
  if (ring == nullptr) return;
  Outline outline;
  for (int i = 0; i < ring->getNumPoints(); ++i) outline.push_back({ring->getX(i), ring->getY(i)});
  outlines.push_back(std::move(outline));
}

/// The outer rings of a polygon, or of several; none of anything else.
std::vector<Outline> outlines_of(const OGRGeometry* geometry) {
  std::vector<Outline> outlines;
  if (geometry == nullptr || geometry->IsEmpty()) return outlines;
  std::unique_ptr<OGRGeometry> straight;  // without arcs
  if (geometry->hasCurveGeometry()) {
    straight.reset(geometry->getLinearGeometry());
    geometry = straight.get();
    if (geometry == nullptr) return outlines;
  }
  const OGRwkbGeometryType type = wkbFlatten(geometry->getGeometryType());
  if (type == wkbPolygon) add_outline(*geometry->toPolygon(), outlines);
  if (type == wkbMultiPolygon) {
    for (const OGRPolygon* part : *geometry->toMultiPolygon()) add_outline(*part, outlines);
  }
  return outlines;
}

/// Empty if it is not told.
std::vector<geo::LatLon> ring_of(const OGRFeature& feature, bool north_first, Projection& projection) {
  std::vector<Outline> outlines = outlines_of(feature.GetGeometryRef());
  if (north_first) {
    for (Outline& outline : outlines) {
      for (glm::dvec2& corner : outline) std::swap(corner.x, corner.y);
    }
  }
  const std::vector<glm::dvec2> coordinates = ring_of_outlines(std::move(outlines), projection.period());
  std::vector<geo::LatLon> ring(coordinates.size());
  projection.to_places(coordinates, ring);
  for (const geo::LatLon& place : ring) {
    if (!std::isfinite(place.latitude.value) || !std::isfinite(place.longitude.value)) return {};
  }
  join_longitudes(ring);
  return ring;
}

}  // namespace

Result<RasterList> read_raster_index(const std::filesystem::path& file, const std::string& name, const geo::Ellipsoid& world) {
  prepare_gdal();
  const QuietErrors quiet;
  const GDALDatasetUniquePtr dataset(GDALDataset::Open(file.c_str(), GDAL_OF_VECTOR | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR));
  if (!dataset) {
    return Error{ErrorCode::unsupported, fmt::format("{}: no list of rasters; lists are folders, VRTs, STAC items and vector files as gdaltindex makes them, and a "
                                                     "single raster is a source of type \"gdal\"{}{}", name, quiet.last().empty() ? "" : ": ", quiet.last())};
  }
  const std::optional<Index> index = find_index(*dataset);
  if (!index) return Error{ErrorCode::unsupported, fmt::format("{}: has no layer with a field \"location\" that names rasters; gdaltindex makes such files", name)};
  Result<std::optional<Projection>> projection = projection_of(*index->layer, world);
  if (!projection) return Error{projection.error().code, fmt::format("{}: {}", name, projection.error().message)};
  const bool north_first = is_north_first(*index->layer);
  const std::filesystem::path folder = file.parent_path();
  ListMaker made(name);
  {
    const QuietErrors while_reading;
    for (const OGRFeatureUniquePtr& feature : *index->layer) {
      const std::string written = feature->IsFieldSetAndNotNull(index->field) ? feature->GetFieldAsString(index->field) : "";
      if (written.empty()) {
        made.leave_out(fmt::format("{}: feature {} names no raster.", name, feature->GetFID()));
        continue;
      }
      ListedRaster raster{listed_path(written, folder), {}, Metres(0.0)};
      if (projection.value()) raster.ring = ring_of(*feature, north_first, *projection.value());
      if (!made.add(std::move(raster))) break;
    }
    if (!while_reading.last().empty()) made.leave_out(fmt::format("{}: some of it cannot be read: {}.", name, while_reading.last()));
  }
  return std::move(made).finish();
}

}  // namespace tellurion::source
