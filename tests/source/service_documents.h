// Documents of services for tests: what MapProxy wrote, and others by hand after the standards.
#pragma once

#include <fstream>
#include <sstream>
#include <string>

namespace test_services {

inline std::string saved(const std::string& name) {
  std::ifstream stream(std::string(TELLURION_TEST_DATA_DIR) + "/services/" + name, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// A WMTS with limits, dimensions, two styles, templates, and degrees in the order of EPSG:4326.
inline const char* const kWmts = R"(<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE Capabilities>
<w:Capabilities xmlns:w="http://www.opengis.net/wmts/1.0" xmlns:o="http://www.opengis.net/ows/1.1" xmlns:xlink="http://www.w3.org/1999/xlink" version="1.0.0">
 <o:ServiceIdentification><o:Title>Rain &amp; snow</o:Title></o:ServiceIdentification>
 <o:ServiceProvider><o:ProviderName> The Weather Office </o:ProviderName></o:ServiceProvider>
 <o:OperationsMetadata><o:Operation name="GetTile"><o:DCP><o:HTTP>
   <o:Get xlink:href="http://h/rest"><o:Constraint name="GetEncoding"><o:AllowedValues><o:Value>RESTful</o:Value></o:AllowedValues></o:Constraint></o:Get>
   <o:Get xlink:href="http://h/kvp?"><o:Constraint name="GetEncoding"><o:AllowedValues><o:Value>KVP</o:Value></o:AllowedValues></o:Constraint></o:Get>
 </o:HTTP></o:DCP></o:Operation></o:OperationsMetadata>
 <w:Contents>
  <w:Layer><o:Title>Rain</o:Title><o:Identifier>rain</o:Identifier>
   <o:WGS84BoundingBox><o:LowerCorner>-10 35</o:LowerCorner><o:UpperCorner>30 60</o:UpperCorner></o:WGS84BoundingBox>
   <w:Style><o:Identifier>grey</o:Identifier></w:Style><w:Style isDefault="true"><o:Identifier>blue</o:Identifier></w:Style>
   <w:Format>image/png</w:Format><w:Format>image/jpeg</w:Format>
   <w:Dimension><o:Identifier>Time</o:Identifier><w:Default>2020-01-02</w:Default><w:Value>2020-01-01</w:Value><w:Value>2020-01-02</w:Value></w:Dimension>
   <w:Dimension><o:Identifier>Level</o:Identifier><w:Value>0</w:Value><w:Value>500</w:Value></w:Dimension>
   <w:TileMatrixSetLink><w:TileMatrixSet>degrees</w:TileMatrixSet><w:TileMatrixSetLimits>
     <w:TileMatrixLimits><w:TileMatrix>one</w:TileMatrix><w:MinTileRow>0</w:MinTileRow><w:MaxTileRow>1</w:MaxTileRow><w:MinTileCol>1</w:MinTileCol><w:MaxTileCol>2</w:MaxTileCol></w:TileMatrixLimits>
   </w:TileMatrixSetLimits></w:TileMatrixSetLink>
   <w:ResourceURL format="image/png" resourceType="tile" template="http://h/{Style}/{Time}/{TileMatrix}/{TileRow}/{TileCol}.png"/>
   <w:ResourceURL format="text/html" resourceType="FeatureInfo" template="http://h/info"/>
  </w:Layer>
  <w:TileMatrixSet><o:Identifier>degrees</o:Identifier><o:SupportedCRS>urn:ogc:def:crs:EPSG::4326</o:SupportedCRS>
   <w:TileMatrix><o:Identifier>zero</o:Identifier><w:ScaleDenominator>2.795411320143589E8</w:ScaleDenominator><w:TopLeftCorner>90.0 -180.0</w:TopLeftCorner>
     <w:TileWidth>256</w:TileWidth><w:TileHeight>256</w:TileHeight><w:MatrixWidth>2</w:MatrixWidth><w:MatrixHeight>1</w:MatrixHeight></w:TileMatrix>
   <w:TileMatrix><o:Identifier>one</o:Identifier><w:ScaleDenominator>1.3977056600717944E8</w:ScaleDenominator><w:TopLeftCorner>90.0 -180.0</w:TopLeftCorner>
     <w:TileWidth>256</w:TileWidth><w:TileHeight>256</w:TileHeight><w:MatrixWidth>4</w:MatrixWidth><w:MatrixHeight>2</w:MatrixHeight></w:TileMatrix>
   <w:TileMatrix><o:Identifier>broken</o:Identifier><w:ScaleDenominator>-1</w:ScaleDenominator><w:TopLeftCorner>90.0</w:TopLeftCorner></w:TileMatrix>
  </w:TileMatrixSet>
 </w:Contents>
</w:Capabilities>)";

inline const char* const kWms13 = R"(<?xml version="1.0"?>
<WMS_Capabilities version="1.3.0" xmlns="http://www.opengis.net/wms" xmlns:xlink="http://www.w3.org/1999/xlink">
 <Service><Name>WMS</Name><Title>Maps</Title><MaxWidth>200</MaxWidth><MaxHeight>4000</MaxHeight></Service>
 <Capability><Request><GetMap><Format>image/png</Format><Format>image/jpeg</Format>
   <DCPType><HTTP><Get><OnlineResource xlink:href="http://h/wms?map=a&amp;"/></Get></HTTP></DCPType></GetMap></Request>
  <Layer><Title>All</Title><CRS>EPSG:4326</CRS><CRS>CRS:84</CRS>
   <EX_GeographicBoundingBox><westBoundLongitude>170</westBoundLongitude><eastBoundLongitude>-170</eastBoundLongitude><southBoundLatitude>-20</southBoundLatitude><northBoundLatitude>10</northBoundLatitude></EX_GeographicBoundingBox>
   <BoundingBox CRS="EPSG:4326" minx="-20" miny="-180" maxx="10" maxy="180"/>
   <Attribution><Title>The mapmakers</Title></Attribution>
   <Style><Name>plain</Name></Style>
   <Layer opaque="1"><Name>ground</Name><Title>Ground</Title><CRS>EPSG:25832</CRS><Style><Name>relief</Name></Style>
    <BoundingBox CRS="EPSG:25832" minx="400000" miny="5000000" maxx="800000" maxy="5200000"/>
    <MinScaleDenominator>5000</MinScaleDenominator><MaxScaleDenominator>1000000</MaxScaleDenominator>
    <Layer><Name>roads</Name><CRS>EPSG:3857</CRS><Attribution><Title>Road people</Title></Attribution></Layer>
   </Layer>
  </Layer></Capability>
</WMS_Capabilities>)";

inline const char* const kWms11 = R"(<?xml version="1.0"?>
<!DOCTYPE WMT_MS_Capabilities SYSTEM "http://schemas.opengis.net/wms/1.1.1/WMS_MS_Capabilities.dtd" [ <!ELEMENT VendorSpecificCapabilities EMPTY> ]>
<WMT_MS_Capabilities version="1.1.1"><Service><Title>Old maps</Title></Service>
 <Capability><Request><GetMap><Format>image/png</Format>
   <DCPType><HTTP><Get><OnlineResource xmlns:xlink="http://www.w3.org/1999/xlink" xlink:href="http://h/old"/></Get></HTTP></DCPType></GetMap></Request>
  <Layer><Name>a</Name><SRS>EPSG:4326 EPSG:31467</SRS><SRS>EPSG:3857</SRS><LatLonBoundingBox minx="5" miny="45" maxx="15" maxy="55"/>
   <BoundingBox SRS="EPSG:31467" minx="3300000" miny="5000000" maxx="3900000" maxy="6100000"/><ScaleHint min="0" max="39.5979797464467"/></Layer>
 </Capability>
</WMT_MS_Capabilities>)";

}  // namespace test_services
