// What sources over WMTS, WMS and TMS share: documents, tiles by URL, choices.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "fetch/byte_store.h"
#include "source/tiles/service_source.h"
#include "source/tiles/service_url.h"
#include "source/tiles/tile_pyramid.h"
#include "source/tiles/tile_supply.h"

namespace tellurion::source {

/// Says who is wrong: `{name}: {message}`.
Error naming(const std::string& name, const Error& error);

/// "a, b, c and 17 more".
std::string listed(const std::vector<std::string>& names);

/// A document of the service and what it means. What cannot be read is not kept: it is asked for anew next time.
/// Waits for up to half a minute. Errors name the URL without credentials.
template <class Parsed>
Result<Parsed> fetch_document(const std::string& url, const std::vector<std::string>& headers, fetch::ByteStore& store,
                              Result<Parsed> (*parse)(std::string_view));

/// Tiles by URL; the URL without credentials is their key in caches. `url_of`: empty for a tile that there is not. What is an exception of
/// the service instead of a picture becomes an error and is not kept. The options' headers go to the server of their URL only.
/// `dimensions`: those of the tiles, whose names may look like those of credentials.
using UrlOfTile = std::function<std::string(const TileAddress&)>;
std::shared_ptr<const TileSupply> service_tiles(UrlOfTile url_of, const ServiceOptions& options, const Parameters& dimensions,
                                                std::shared_ptr<fetch::ByteStore> store);

/// Tells apart what differs by its dimensions only; empty without any. Does not show their values.
std::string mark_of(const Parameters& dimensions);

/// The format to ask for, of those that there are. Errors: invalid_argument (the one wanted is not there).
Result<std::string> choose_format(const ServiceOptions& options, const std::vector<std::string>& formats, bool opaque);

/// Leaves out levels that the user does not want. Errors: invalid_argument (none would be left).
Result<void> keep_levels(TileGrid& grid, const ServiceOptions& options);

/// The rest of a pyramid, and opens it. `declared`: bounds as the service has them, in degrees; where they make no sense they
/// do not count.
Result<std::unique_ptr<RasterSource>> open_service(TilePyramid pyramid, const ServiceOptions& options,
                                                   const std::optional<std::array<double, 4>>& declared, const geo::Ellipsoid& world);

/// A document's bytes: see fetch_document.
Result<std::string> fetch_document_bytes(const std::string& url, const std::vector<std::string>& headers, fetch::ByteStore& store);

/// The document is not kept. Returns what is wrong with it, without secrets that it repeats.
Error reject_document(const std::string& url, const Error& error, fetch::ByteStore& store);

template <class Parsed>
Result<Parsed> fetch_document(const std::string& url, const std::vector<std::string>& headers, fetch::ByteStore& store,
                              Result<Parsed> (*parse)(std::string_view)) {
  const Result<std::string> bytes = fetch_document_bytes(url, headers, store);
  if (!bytes) return bytes.error();
  Result<Parsed> parsed = parse(*bytes);
  if (!parsed) return reject_document(url, parsed.error(), store);
  return parsed;
}

}  // namespace tellurion::source
