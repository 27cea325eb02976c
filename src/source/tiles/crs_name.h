// Names of coordinate reference systems as services write them.
// Thread-safe: pure functions.
#pragma once

#include <string>
#include <string_view>

namespace tellurion::source {

/// In words that PROJ understands: "urn:ogc:def:crs:EPSG::3857", "http://www.opengis.net/def/crs/EPSG/0/3857" and the unofficial
/// "EPSG:900913" become "EPSG:3857", "CRS:84" becomes "OGC:CRS84". What is none of these comes back as it is.
std::string crs_name(std::string_view written);

}  // namespace tellurion::source
