// How far every tile's own grid of heights is from the finest data under it, for the tiles that are coarser than the data.
// Immutable once made; made by the jobs of error_scan.h or read from a kept file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "geo/tile_key.h"
#include "surface/height_error.h"

namespace tellurion::surface {

/// What is known of the heights under a tile.
struct TileRecord {
  float min_height = 0;  ///< metres above the ellipsoid, of the finest data
  float max_height = 0;
  HeightError error;     ///< of the tile's own full grid, at least that of every tile below
  std::uint32_t whole = 0;  ///< 1: the only raster of the table is known to cover all of the tile, so that layers below do not show

  friend bool operator==(const TileRecord&, const TileRecord&) = default;
};

/// A quadtree of records in one array; four children lie together.
class RecordTree {
 public:
  struct Node {
    TileRecord record;
    std::uint32_t children = 0;  ///< index of the first of four; 0: none, for no node is a child of its own
  };

  /// The roots come first.
  explicit RecordTree(std::size_t root_count) : nodes_(root_count) {}

  Node& operator[](std::size_t i) { return nodes_[i]; }
  const Node& operator[](std::size_t i) const { return nodes_[i]; }
  std::size_t size() const { return nodes_.size(); }
  /// Index of the first of four new children of `parent`.
  std::size_t add_children(std::size_t parent);
  const std::vector<Node>& nodes() const { return nodes_; }
  std::vector<Node>& nodes() { return nodes_; }

 private:
  std::vector<Node> nodes_;
};

class ErrorTable {
 public:
  /// `tree` has the six faces as its roots.
  explicit ErrorTable(RecordTree tree);

  struct Found {
    TileRecord record;
    bool own = false;  ///< of the tile itself; else of the deepest ancestor that has one
  };
  Found find(const geo::TileKey& key) const;

  std::size_t tile_count() const { return tree_.size(); }

  /// Writes the table so that a reader sees all of it or nothing. Errors: unavailable, naming the file.
  Result<void> save(const std::filesystem::path& path, std::string_view revision) const;
  /// Errors: not_found; corrupt (wrong checksum, cut off, or of another `revision`). In either case: scan again.
  static Result<ErrorTable> load(const std::filesystem::path& path, std::string_view revision);
  /// The content of such a file, whatever it is; `name` is what errors call it.
  static Result<ErrorTable> from_bytes(std::span<const char> content, std::string_view revision, const std::string& name);

 private:
  RecordTree tree_;
};

}  // namespace tellurion::surface
