#include "source/tiles/service_tiles.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "base/hash.h"
#include "fetch/fetch_now.h"
#include "source/tiles/bounded_xml.h"
#include "source/tiles/height_decoders.h"

namespace tellurion::source {
namespace {

constexpr std::chrono::seconds kLongestWait{30};
constexpr std::size_t kMostListed = 24;

/// How a service says that there is no such tile.
bool is_out_of_range(const std::string& bytes) {
  const auto exception = service_exception(bytes);
  return exception && exception->find("TileOutOfRange") != std::string::npos;
}

/// What is wrong with bytes that are no picture but an exception of the service.
std::optional<std::string> refusal(const std::string& url, const std::string& bytes) {
  const auto exception = service_exception(bytes);
  if (!exception || is_out_of_range(bytes)) return std::nullopt;
  return fmt::format("{}: the service answers: {}", fetch::public_part(url), without_secrets(*exception, url, fetch::without_credentials(url)));
}

class ServiceTiles final : public TileSupply {
 public:
  ServiceTiles(UrlOfTile url_of, const ServiceOptions& options, const Parameters& dimensions, std::shared_ptr<fetch::ByteStore> store)
      : url_of_(std::move(url_of)), given_(options.url), headers_(options.headers), mark_(mark_of(dimensions)), store_(std::move(store)) {}

  fetch::Asked ask(const TileAddress& tile, const TileWish& wish) const override {
    const std::string url = url_of_(tile);
    if (url.empty()) return fetch::File{};
    const auto refuse = [url](const std::string& bytes) { return refusal(url, bytes); };
    const std::vector<std::string> headers = same_server(url, given_) ? headers_ : std::vector<std::string>();
    fetch::Asked asked = store_->ask({url, headers, key_of(url), {}, wish.expected_bytes, {}, refuse}, wish.gain);
    const auto* file = std::get_if<fetch::File>(&asked);
    if (file && file->bytes && is_out_of_range(*file->bytes)) return fetch::File{};
    return asked;
  }
  void reject(const TileAddress& tile, const std::string& why) const override { store_->reject(key_of(url_of_(tile)), why); }
  std::string name_of(const TileAddress& tile) const override { return fmt::format("{} (tile {}/{}/{})", fetch::public_part(url_of_(tile)), tile.zoom, tile.column, tile.row); }

 private:
  std::string key_of(const std::string& url) const { return fetch::without_credentials(url) + mark_; }

  UrlOfTile url_of_;
  std::string given_;  ///< by the user
  std::vector<std::string> headers_;
  std::string mark_;   ///< see mark_of
  std::shared_ptr<fetch::ByteStore> store_;
};

/// What is left of the bounds that a service declares; nothing if they say nothing.
std::optional<std::array<double, 4>> sensible(const std::optional<std::array<double, 4>>& declared) {
  if (!declared) return std::nullopt;
  const auto [west, south, east, north] = *declared;
  const std::array bounds{std::clamp(west, -180.0, 180.0), std::clamp(south, -90.0, 90.0), std::clamp(east, -180.0, 180.0), std::clamp(north, -90.0, 90.0)};
  if (!(bounds[0] < bounds[2] && bounds[1] < bounds[3])) return std::nullopt;
  return bounds;
}

}  // namespace

Error naming(const std::string& name, const Error& error) { return {error.code, fmt::format("{}: {}", name, error.message)}; }

std::string listed(const std::vector<std::string>& names) {
  std::string all;
  for (std::size_t i = 0; i < std::min(names.size(), kMostListed); ++i) all += (i == 0 ? "" : ", ") + names[i].substr(0, 100);
  if (names.size() > kMostListed) all += fmt::format(" and {} more", names.size() - kMostListed);
  return names.empty() ? "none" : all;
}

Result<std::string> fetch_document_bytes(const std::string& url, const std::vector<std::string>& headers, fetch::ByteStore& store) {
  return fetch::fetch_now(store, {url, headers, fetch::without_credentials(url), {}}, kLongestWait);
}

Error reject_document(const std::string& url, const Error& error, fetch::ByteStore& store) {
  const std::string shown = fetch::without_credentials(url);
  const Error why = naming(shown, {error.code, without_secrets(error.message, url, shown)});
  store.reject(shown, why.message);
  return why;
}

std::shared_ptr<const TileSupply> service_tiles(UrlOfTile url_of, const ServiceOptions& options, const Parameters& dimensions,
                                                std::shared_ptr<fetch::ByteStore> store) {
  return std::make_shared<ServiceTiles>(std::move(url_of), options, dimensions, std::move(store));
}

std::string mark_of(const Parameters& dimensions) {
  std::string text;
  for (const auto& [name, value] : dimensions) text += fmt::format("{}={}\n", name, value);
  return text.empty() ? text : fmt::format("#{:016x}", fnv1a(text));
}

Result<std::string> choose_format(const ServiceOptions& options, const std::vector<std::string>& formats, bool opaque) {
  const auto find = [&](auto fits) {
    const auto found = std::find_if(formats.begin(), formats.end(), fits);
    return found == formats.end() ? std::string() : *found;
  };
  if (!options.format.empty()) {
    std::string found = find([&](const std::string& f) { return f == options.format; });
    if (found.empty()) return Error{ErrorCode::invalid_argument, fmt::format("has no format \"{}\"; it has {}", options.format, listed(formats))};
    return found;
  }
  if (options.kind == SampleKind::height && options.encoding.empty()) {
    std::string numbers = find([](const std::string& f) { return f.find("tiff") != std::string::npos; });
    if (numbers.empty()) return Error{ErrorCode::unsupported, fmt::format("offers no TIFF, which heights need unless `encoding` says how they are in a picture; it has {}", listed(formats))};
    return numbers;
  }
  const bool lossy = opaque && options.kind != SampleKind::height;
  for (const char* wanted : {lossy ? "image/jpeg" : "image/png", "image/webp", lossy ? "image/png" : "image/jpeg"}) {
    if (std::string found = find([&](const std::string& f) { return f == wanted; }); !found.empty()) return found;
  }
  std::string picture = find([](const std::string& f) { return f.starts_with("image/"); });
  if (picture.empty()) return Error{ErrorCode::unsupported, fmt::format("offers no pictures; its formats are {}", listed(formats))};
  return picture;
}

Result<void> keep_levels(TileGrid& grid, const ServiceOptions& options) {
  const int last = static_cast<int>(grid.levels.size()) - 1;
  const int most = std::min(options.most_level.value_or(last), last), least = std::max(options.least_level.value_or(0), grid.min_zoom);
  if (least > most)
    return Error{ErrorCode::invalid_argument, fmt::format("min_level = {} and max_level = {} leave nothing of its levels {} to {}", least, most, grid.min_zoom, last)};
  grid.levels.resize(static_cast<std::size_t>(most) + 1);
  grid.min_zoom = least;
  return {};
}

Result<std::unique_ptr<RasterSource>> open_service(TilePyramid pyramid, const ServiceOptions& options,
                                                   const std::optional<std::array<double, 4>>& declared, const geo::Ellipsoid& world) {
  if (const Result<void> kept = keep_levels(pyramid.grid, options); !kept) return naming(pyramid.name, kept.error());
  pyramid.kind = options.kind;
  pyramid.decode_heights = height_decoder(options.encoding, pyramid.grid);
  pyramid.encoding = options.encoding;
  pyramid.sample_type = options.kind == SampleKind::height && options.encoding.empty() ? "Float32" : "Byte";
  pyramid.vertical = options.vertical;
  pyramid.is_remote = true;
  pyramid.bounds = options.bounds ? options.bounds : sensible(declared);
  if (!options.bounds && pyramid.bounds) {
    Result<std::unique_ptr<RasterSource>> opened = open_pyramid(pyramid, world);
    if (opened) return opened;
    pyramid.bounds.reset();
  }
  return open_pyramid(std::move(pyramid), world);
}

}  // namespace tellurion::source
