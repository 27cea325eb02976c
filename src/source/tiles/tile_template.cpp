#include "source/tiles/tile_template.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

namespace tellurion::source {

Result<TileTemplate> TileTemplate::parse(const std::string& text, std::vector<std::string> subdomains) {
  constexpr std::pair<const char*, Field> kFields[] = {{"z", Field::zoom}, {"x", Field::column}, {"y", Field::row},
                                                       {"-y", Field::row_from_south}, {"q", Field::quadkey}, {"s", Field::subdomain}};
  TileTemplate made;
  made.subdomains_ = std::move(subdomains);
  std::size_t at = 0;
  const auto has = [&](Field field) { return std::any_of(made.pieces_.begin(), made.pieces_.end(), [&](const Piece& p) { return p.field == field; }); };
  for (std::size_t open = text.find('{'); open != std::string::npos; open = text.find('{', at)) {
    const std::size_t close = text.find('}', open);
    const std::string name = text.substr(open + 1, close == std::string::npos ? close : close - open - 1);
    const auto* known = std::find_if(std::begin(kFields), std::end(kFields), [&](const auto& field) { return field.first == name; });
    if (close == std::string::npos || known == std::end(kFields))
      return Error{ErrorCode::invalid_argument, fmt::format("{{{}}} means nothing in a tile URL: it knows {{z}}, {{x}}, {{y}}, {{-y}}, {{q}} and {{s}}",
                                                              name.substr(0, name.find_first_of("?&/. {")))};  // without a } a key may follow
    made.pieces_.push_back({text.substr(at, open - at), known->second});
    at = close + 1;
  }
  made.end_ = text.substr(at);
  const bool by_numbers = has(Field::zoom) && has(Field::column) && (has(Field::row) || has(Field::row_from_south));
  if (!by_numbers && !has(Field::quadkey))
    return Error{ErrorCode::invalid_argument, "a tile URL needs {z}, {x} and {y} (or {-y}), or {q}; an example: http://host/{z}/{x}/{y}.png"};
  if (has(Field::subdomain) && made.subdomains_.empty())
    return Error{ErrorCode::invalid_argument, "the URL has {s}: say which ones there are, for example subdomains = [\"a\", \"b\", \"c\"]"};
  return made;
}

std::string TileTemplate::url(const TileAddress& tile, std::int64_t rows) const {
  std::string out;
  for (const Piece& piece : pieces_) {
    out += piece.text;
    switch (piece.field) {
      case Field::zoom:
        out += std::to_string(tile.zoom);
        break;
      case Field::column:
        out += std::to_string(tile.column);
        break;
      case Field::row:
        out += std::to_string(tile.row);
        break;
      case Field::row_from_south:
        out += std::to_string(rows - 1 - tile.row);
        break;
      case Field::quadkey:
        for (int bit = tile.zoom - 1; bit >= 0; --bit) out += static_cast<char>('0' + (tile.column >> bit & 1) + 2 * (tile.row >> bit & 1));
        break;
      case Field::subdomain:
        out += subdomains_[static_cast<std::size_t>(tile.column + tile.row) % subdomains_.size()];
        break;
    }
  }
  return out + end_;
}

}  // namespace tellurion::source
