#include "surface/error_scan.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "surface/height_field.h"
#include "surface/rtin.h"
#include "surface/tile_grid.h"
#include "surface/tile_samples.h"
#include "surface/whole_cover.h"

namespace tellurion::surface {
namespace {

constexpr int kJobLevel = 2;
constexpr int kJobsPerFace = 1 << (2 * kJobLevel);
constexpr double kMostSamplesOfPart = 4e6;
constexpr int kRun = 16;  ///< samples of a row that are left out together

/// The surface between samples is compared where those round it are off by this share of the worst so far, up to a quarter of
/// a sample apart; between such places the deviation can be a little larger.
constexpr double kWorthALook = 0.4;
constexpr double kBetweenPlaces = 1.15;

constexpr TileRecord kNothingYet{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(), {}, 0};

void include(TileRecord& record, const TileRecord& part) {
  record.min_height = std::min(record.min_height, part.min_height);
  record.max_height = std::max(record.max_height, part.max_height);
  record.error = larger(record.error, part.error);
}

/// Whether the table ends with this tile.
bool is_leaf(const SurfaceDescription& description, const geo::TileKey& key) {
  return nominal_grid_spacing(description.ellipsoid, key.level) <= kFinestGridOfTable * finest_spacing(description.heights, key) ||
         key.level >= geo::kMaxTileLevel;
}

void include(OpenRecord& all, const OpenRecord& part) {
  include(all.record, part.record);
  all.worst = std::max(all.worst, part.worst);
  all.tally.add(part.tally, 1.0);
}

TileRecord finished(const OpenRecord& tile) {
  TileRecord record = tile.record;
  const auto rounded_up = [](double metres) { return metres > 0.0 ? std::nextafter(static_cast<float>(metres), INFINITY) : 0.0f; };
  const double bound = kBetweenPlaces * tile.worst;
  record.error = larger(record.error, {rounded_up(bound), rounded_up(std::min(tile.tally.common(), bound))});
  return record;
}

/// What the four children of a node say of it.
void include_children(RecordTree& tree, std::size_t node) {
  const std::size_t first = tree[node].children;
  if (first == 0) return;
  TileRecord& record = tree[node].record;
  record.whole = 1;
  for (std::size_t i = 0; i < 4; ++i) {
    include(record, tree[first + i].record);
    record.whole &= tree[first + i].record.whole;
  }
}

/// Puts a subtree in the place of a leaf: its root takes the place that is there, all that follow move up behind what the tree holds.
void graft(RecordTree& tree, std::size_t node, const RecordTree& subtree) {
  const auto shift = static_cast<std::uint32_t>(tree.size() - 1);
  for (std::size_t i = 0; i < subtree.size(); ++i) {
    RecordTree::Node moved = subtree[i];
    if (moved.children != 0) moved.children += shift;
    if (i == 0) {
      tree[node] = moved;
    } else {
      tree.nodes().push_back(moved);
    }
  }
}

/// The node of a child, with all four made if they are not there.
std::size_t child_node(RecordTree& tree, std::size_t node, const geo::TileKey& child) {
  if (tree[node].children == 0) {
    const std::size_t first = tree.add_children(node);
    for (std::size_t i = 0; i < 4; ++i) tree[first + i].record = kNothingYet;
  }
  return tree[node].children + static_cast<std::size_t>(geo::child_index(child));
}

/// A tile of the path from a root to the leaf being scanned, with its grid.
struct OnPath : OpenRecord {
  geo::TileKey key;
  geo::FaceRect rect;
  double steps_per_unit = 0.0;  ///< of the grid, per unit of face coordinates
  std::vector<double> heights;
  DeviationTally in_leaf;  ///< of the leaf being scanned, each as one

  /// The distance at a place. `slack`: how far the surface may be from `metres` round there.
  double compare(glm::dvec2 uv, double metres, double slack = 0.0) {
    const glm::dvec2 grid = (uv - rect.lower) * steps_per_unit;
    const double off = std::abs(metres - interpolate_in_triangles(heights, kGridSide, grid.x, grid.y)) + slack;
    worst = std::max(worst, off);
    return off;
  }

  /// How far a point lies beside the tile; NaN for one that is not there.
  double outside(glm::dvec2 uv) const {
    const glm::dvec2 below = rect.lower - uv, beyond = uv - rect.upper;
    return std::isfinite(uv.x) ? std::max(std::max(below.x, below.y), std::max(beyond.x, beyond.y)) : NAN;
  }
};

/// A sample of a raster, seen from the face.
struct FaceSample {
  glm::dvec2 uv{NAN};
  double metres = 0.0;
  bool within = false;    ///< the leaf
  double off_leaf = 0.0;  ///< its distance from the leaf's grid and from that of the leaf's parent
  double off_parent = 0.0;
};

class Scanner {
 public:
  Scanner(ElevationModel& model, std::stop_token stop) : model_(model), stop_(std::move(stop)) {}

  Result<PartScan> run(const geo::TileKey& root) {
    PartScan scan;
    scan.root = root;
    for (int level = 0; level < root.level; ++level) {
      if (Result<void> pushed = push(geo::ancestor(root, level)); !pushed) return pushed.error();
    }
    if (Result<void> done = descend(root, scan.tree, 0); !done) return done.error();
    for (OnPath& tile : path_) scan.above.push_back(std::move(tile));
    return scan;
  }

 private:
  Result<void> push(const geo::TileKey& key) {
    OnPath tile;
    tile.record = kNothingYet;
    tile.key = key;
    tile.rect = geo::face_rect(key);
    tile.steps_per_unit = (kGridSide - 1) / (tile.rect.upper.x - tile.rect.lower.x);
    tile.heights.resize(static_cast<std::size_t>(kGridSide) * kGridSide);
    const double spacing = nominal_grid_spacing(model_.description().ellipsoid, key.level);
    if (Result<void> read = model_.heights(TileLattice{key, kGridSide}, spacing, tile.heights); !read) return read;
    path_.push_back(std::move(tile));
    return {};
  }

  Result<void> descend(const geo::TileKey& key, RecordTree& tree, std::size_t node) {
    if (stop_.stop_requested()) return {ErrorCode::cancelled, "error table"};
    if (Result<void> pushed = push(key); !pushed) return pushed;
    if (is_leaf(model_.description(), key)) {
      if (Result<void> scanned = scan_leaf(); !scanned) return scanned;
    } else {
      const std::size_t children = tree.add_children(node);
      for (int i = 0; i < 4; ++i) {
        const std::size_t child = children + static_cast<std::size_t>(i);
        if (Result<void> done = descend(geo::child(key, i), tree, child); !done) return done;
      }
    }
    tree[node].record = finished(path_.back());
    include_children(tree, node);
    path_.pop_back();
    return {};
  }

  Result<void> scan_leaf() {
    OnPath& leaf = path_.back();
    const Result<bool> whole = is_covered_by_one(model_, leaf.key);
    if (!whole) return whole.error();
    leaf.record.whole = *whole ? 1 : 0;
    const auto [lowest, highest] = std::minmax_element(leaf.heights.begin(), leaf.heights.end());
    extend_range(*lowest, *highest);
    const double finest = finest_spacing(model_.description().heights, leaf.key);
    const bool finer_than_data = nominal_grid_spacing(model_.description().ellipsoid, leaf.key.level) <= 0.75 * finest;
    const Result<void> scanned = finer_than_data ? compare_fine_grid() : compare_samples();
    if (!scanned) return scanned;
    for (OnPath& tile : path_) {
      const double count = tile.in_leaf.count();
      if (count > 0.0) tile.tally.add(tile.in_leaf, std::ldexp(1.0, -2 * leaf.key.level) / count);
      tile.in_leaf = {};
    }
    for (std::size_t i = 0; i + 1 < path_.size(); ++i) {
      path_[i].record.min_height = std::min(path_[i].record.min_height, leaf.record.min_height);
      path_[i].record.max_height = std::max(path_[i].record.max_height, leaf.record.max_height);
    }
    return {};
  }

  /// A leaf beside finer data: its own grid stands for the surface. Coarser grids differ most from it at its points, for they
  /// are linear on each of its triangles.
  Result<void> compare_fine_grid() {
    const geo::TileKey key = path_.back().key;
    const Result<HeightField> field = field_of_finest_data(model_, key);
    if (!field) return field.error();
    for (std::size_t i = 0; i < field->heights.size(); ++i) {
      const glm::dvec2 share = glm::dvec2(i % kGridSide, i / kGridSide) / static_cast<double>(kGridSide - 1);
      const glm::dvec2 uv = glm::mix(path_.back().rect.lower, path_.back().rect.upper, share);
      for (OnPath& tile : path_) tile.in_leaf.add(tile.compare(uv, field->heights[i], static_cast<double>(field->error.bound)));
    }
    const auto [lowest, highest] = std::minmax_element(field->heights.begin(), field->heights.end());
    const auto beyond = static_cast<double>(field->error.bound);
    extend_range(*lowest - beyond, *highest + beyond);
    return {};
  }

  /// Every raster's own samples; and half-way between the grid's points: along the borders, which lie between samples, and
  /// where some raster ends everywhere.
  Result<void> compare_samples() {
    const geo::TileKey& key = path_.back().key;
    const double finest = finest_spacing(model_.description().heights, key);
    bool some_raster_ends = false;
    const Result<void> all = model_.for_each_under(key, [&](cache::CachedRaster& raster, Metres spacing) {
      some_raster_ends = some_raster_ends || (!raster.description().wraps && path_.back().record.whole == 0);
      return scan_raster(raster, spacing.value <= finest);
    });
    if (!all) return all;
    if (Result<void> compared = compare_half_steps(some_raster_ends); !compared) return compared;
    if (some_raster_ends) {
      // Where rasters are blended, heights between the places may lie beyond those found.
      const OnPath& leaf = path_.back();
      const double beyond = (kBetweenPlaces - 1.0) * leaf.worst;
      extend_range(static_cast<double>(leaf.record.min_height) - beyond, static_cast<double>(leaf.record.max_height) + beyond);
    }
    return {};
  }

  Result<void> compare_half_steps(bool inside_too) {
    constexpr int kLast = 2 * (kGridSide - 1);
    const OnPath& leaf = path_.back();
    std::vector<glm::dvec2> uv;
    std::vector<geo::Vector<geo::Ecef>> normals;
    for (int y = 0; y <= kLast; ++y) {
      const bool whole_row = inside_too || y == 0 || y == kLast;
      for (int x = 0; x <= kLast; x += whole_row ? 1 : kLast) {
        uv.push_back(leaf.rect.lower + (leaf.rect.upper - leaf.rect.lower) * (glm::dvec2(x, y) / static_cast<double>(kLast)));
        normals.push_back(geo::face_normal(leaf.key.face, uv.back()));
      }
    }
    metres_.resize(normals.size());
    if (Result<void> read = model_.heights(normals, 0.0, metres_); !read) return read;
    for (std::size_t i = 0; i < uv.size(); ++i) {
      for (OnPath& tile : path_) {
        const double off = tile.compare(uv[i], metres_[i]);
        if (inside_too) tile.in_leaf.add(off);
      }
    }
    const auto [lowest, highest] = std::minmax_element(metres_.begin(), metres_.end());
    extend_range(*lowest, *highest);
    return {};
  }

  void extend_range(double low, double high) {
    TileRecord& record = path_.back().record;
    record.min_height = std::min(record.min_height, static_cast<float>(std::floor(low)));
    record.max_height = std::max(record.max_height, static_cast<float>(std::ceil(high)));
  }

  /// Compares all samples of a raster within the leaf with the whole path; and the surface between them, if nothing finer
  /// shapes it.
  Result<void> scan_raster(cache::CachedRaster& raster, bool is_finest) {
    source::PixelWindow window = window_under(raster.reader(), raster.description(), path_.back().key);
    if (window.width <= 0 || window.height <= 0) return {};
    include_border(window, raster.description());
    // Samples just outside shape the surface within: three of them, in face coordinates.
    const double quarter = model_.description().ellipsoid.b() * std::numbers::pi / 4.0;
    const double ring = 3.0 * raster.description().spacing.value / quarter;
    const auto width = static_cast<std::size_t>(window.width);
    above_.assign(width, {});
    for (int row = 0; row < window.height; ++row) {
      if (Result<void> read = read_row(raster, window.x, window.y + row, window.width, ring); !read) return read;
      for (std::size_t x = 0; x < width; ++x) {
        FaceSample& here = row_[x];
        if (here.within) compare_sample(here, is_finest);
        if (is_finest && x > 0) compare_cell(above_[x - 1], above_[x], row_[x - 1], here);
      }
      std::swap(row_, above_);
    }
    return {};
  }

  void compare_sample(FaceSample& sample, bool counts) {
    for (OnPath& tile : path_) {
      sample.off_parent = sample.off_leaf;
      sample.off_leaf = tile.compare(sample.uv, sample.metres);
      if (counts) tile.in_leaf.add(sample.off_leaf);
    }
  }

  /// The bilinear surface between four samples, a row above another, against the two finest grids, whose steps are about as
  /// small as the samples'.
  void compare_cell(const FaceSample& a, const FaceSample& b, const FaceSample& c, const FaceSample& d) {
    if (!std::isfinite(a.uv.x + b.uv.x + c.uv.x + d.uv.x)) return;
    const bool all_within = a.within && b.within && c.within && d.within;
    const auto look = [&](OnPath& tile, int step) {  // in quarters of the cell
      double off = 0.0;
      for (int i = 0; i < 4; i += step) {
        for (int j = 0; j < 4; j += step) {
          if (i == 0 && j == 0) continue;  // the sample itself
          const double x = j / 4.0, y = i / 4.0;
          const double la = (1 - x) * (1 - y), lb = x * (1 - y), lc = (1 - x) * y, ld = x * y;
          const glm::dvec2 uv = la * a.uv + lb * b.uv + lc * c.uv + ld * d.uv;
          if (!all_within && path_.back().outside(uv) > 0.0) continue;
          off = std::max(off, tile.compare(uv, la * a.metres + lb * b.metres + lc * c.metres + ld * d.metres));
        }
      }
      return off;
    };
    OnPath& leaf = path_.back();
    double off = std::max(std::max(a.off_leaf, b.off_leaf), std::max(c.off_leaf, d.off_leaf));
    if (!all_within || off >= kWorthALook * leaf.worst) off = std::max(off, look(leaf, 2));
    if (off >= kWorthALook * leaf.worst) look(leaf, 1);
    if (path_.size() < 2) return;
    OnPath& parent = path_[path_.size() - 2];
    const double off_parent = std::max(std::max(a.off_parent, b.off_parent), std::max(c.off_parent, d.off_parent));
    if (!all_within || off_parent >= kWorthALook * parent.worst) look(parent, 2);
  }

  /// One row of the raster's samples: where they lie on the face, and the surface's height where that is on the leaf.
  Result<void> read_row(cache::CachedRaster& raster, int first, int y, int width, double ring) {
    const OnPath& leaf = path_.back();
    const source::LevelSize size = raster.description().levels.front();
    const bool wraps = raster.description().wraps;
    const double pixel_y = sample_place(y, size.height);
    const auto pixel = [&](int i) {
      return glm::dvec2(wraps ? (first + i) % size.width + 0.5 : sample_place(first + i, size.width), pixel_y);
    };
    row_.assign(static_cast<std::size_t>(width), {});

    // Whole runs lie beside the leaf: told by their ends.
    pixels_.clear();
    for (int i = 0; i < width; i += kRun) pixels_.push_back(pixel(i));
    pixels_.push_back(pixel(width - 1));
    project(raster);
    ends_ = projected_;
    pixels_.clear();
    wanted_.clear();
    for (int i = 0; i < width; i += kRun) {
      const auto run = static_cast<std::size_t>(i / kRun);
      const double far = glm::distance(ends_[run], ends_[run + 1]) + ring;
      if (leaf.outside(ends_[run]) > far && leaf.outside(ends_[run + 1]) > far) continue;
      for (int j = i; j < std::min(i + kRun, width); ++j) {
        wanted_.push_back(static_cast<std::size_t>(j));
        pixels_.push_back(pixel(j));
      }
    }
    project(raster);

    std::size_t count = 0;
    for (std::size_t n = 0; n < wanted_.size(); ++n) {
      const double distance = leaf.outside(projected_[n]);
      if (!(distance <= ring)) continue;
      FaceSample& sample = row_[wanted_[n]];
      sample.uv = projected_[n];
      sample.within = distance <= 0.0;
      wanted_[count] = wanted_[n];
      places_[count++] = places_[n];
    }
    if (count == 0) return {};
    metres_.resize(count);
    if (Result<void> read = model_.heights(std::span(places_).first(count), 0.0, metres_); !read) return read;
    for (std::size_t n = 0; n < count; ++n) row_[wanted_[n]].metres = metres_[n];
    const auto [lowest, highest] = std::minmax_element(metres_.begin(), metres_.end());
    extend_range(*lowest, *highest);
    return {};
  }

  /// places_ and face coordinates of pixels_; NaN where there are none.
  void project(cache::CachedRaster& raster) {
    places_.resize(pixels_.size());
    projected_.assign(pixels_.size(), glm::dvec2(NAN));
    raster.reader().to_places(pixels_, places_);
    for (std::size_t i = 0; i < places_.size(); ++i) {
      if (!(std::abs(places_[i].latitude.value) <= std::numbers::pi / 2.0) || !std::isfinite(places_[i].longitude.value)) continue;
      const std::optional<glm::dvec2> uv = geo::project_to_face(path_.back().key.face, geo::normal_at(places_[i]));
      if (uv) projected_[i] = *uv;
    }
  }

  ElevationModel& model_;
  std::stop_token stop_;
  std::vector<OnPath> path_;
  std::vector<glm::dvec2> pixels_;
  std::vector<geo::LatLon> places_;
  std::vector<std::size_t> wanted_;
  std::vector<glm::dvec2> projected_;
  std::vector<glm::dvec2> ends_;
  std::vector<double> metres_;
  std::vector<FaceSample> row_;
  std::vector<FaceSample> above_;
};

}  // namespace

bool is_scanned(const Layer& layer) {
  if (layer.catalogue) return false;
  const source::LevelSize& size = layer.source->description().levels.front();
  return layer.enabled && !layer.source->description().is_remote && static_cast<double>(size.width) * size.height <= kMostScannedSamples;
}

bool wants_prepared_table(const SurfaceDescription& description, const Layer& layer) {
  if (!layer.enabled || layer.catalogue || layer.feather > 0.0 || layer.source->description().is_remote) return false;
  return !is_scanned(layer) || std::ranges::count_if(description.heights, &Layer::enabled) == 1;
}

double finest_spacing(std::span<const Layer> layers, const geo::TileKey& key) {
  double finest = std::numeric_limits<double>::infinity();
  for (const Layer& layer : layers) {
    if (layer.enabled) finest = std::min(finest, coverage_of(layer).spacing_under(key).value);
  }
  return finest;
}

std::string table_revision(const SurfaceDescription& description) {
  std::string revision = std::string(kTableRules) + ", grid " + std::to_string(kGridSide) + "\n" + std::to_string(description.ellipsoid.a()) + " " + std::to_string(description.ellipsoid.b());
  for (const Layer& layer : description.heights) {
    if (!is_scanned(layer)) continue;
    revision += layer.adds ? "\n+" : "\n=";
    revision += layer.source->revision();
    if (layer.feather > 0.0) revision += " feather " + std::to_string(layer.feather);
  }
  return revision;
}

std::string errors_revision(const SurfaceDescription& description) {
  std::string revision = table_revision(description);
  for (const Layer& layer : description.heights) {
    if (wants_prepared_table(description, layer)) revision += "\n*" + layer.source->revision();
  }
  return revision;
}

SurfaceDescription scanned_part(const SurfaceDescription& description) {
  SurfaceDescription part;
  part.ellipsoid = description.ellipsoid;
  part.revision = description.revision;
  std::copy_if(description.heights.begin(), description.heights.end(), std::back_inserter(part.heights), is_scanned);
  return part;
}

std::vector<geo::TileKey> scan_jobs() {
  std::vector<geo::TileKey> jobs;
  for (std::uint8_t face = 0; face < geo::kFaceCount; ++face) {
    for (std::uint32_t i = 0; i < kJobsPerFace; ++i) {
      jobs.push_back({face, kJobLevel, i % (1u << kJobLevel), i >> kJobLevel});
    }
  }
  return jobs;
}

Result<SubtreeScan> scan_subtree(ElevationModel& model, const geo::TileKey& root, std::stop_token stop) {
  const Result<PartScan> all = scan_part(model, root, std::move(stop));
  if (!all) return all.error();
  JobMerge merge(root);
  merge.add(*all);
  return std::move(merge).finish();
}

std::vector<geo::TileKey> parts_of_job(const SurfaceDescription& description, const geo::TileKey& root) {
  const double side = nominal_tile_size(description.ellipsoid, root.level) / finest_spacing(description.heights, root);
  if (side * side <= kMostSamplesOfPart || is_leaf(description, root)) return {root};
  std::vector<geo::TileKey> parts;
  for (int i = 0; i < 4; ++i) {
    const std::vector<geo::TileKey> more = parts_of_job(description, geo::child(root, i));
    parts.insert(parts.end(), more.begin(), more.end());
  }
  return parts;
}

Result<PartScan> scan_part(ElevationModel& model, const geo::TileKey& root, std::stop_token stop) {
  return Scanner(model, std::move(stop)).run(root);
}

JobMerge::JobMerge(const geo::TileKey& root) : root_(root), above_(root.level, OpenRecord{kNothingYet, 0.0, {}}) { tree_[0].record = kNothingYet; }

void JobMerge::add(const PartScan& part) {
  for (std::size_t level = 0; level < above_.size(); ++level) include(above_[level], part.above[level]);
  std::size_t node = 0;
  for (int level = root_.level; level < part.root.level; ++level) {
    include(inner_.try_emplace(node, OpenRecord{kNothingYet, 0.0, {}}).first->second, part.above[static_cast<std::size_t>(level)]);
    node = child_node(tree_, node, geo::ancestor(part.root, level + 1));
  }
  graft(tree_, node, part.tree);
}

SubtreeScan JobMerge::finish() && {
  for (const auto& [node, found] : inner_) tree_[node].record = finished(found);
  for (auto entry = inner_.rbegin(); entry != inner_.rend(); ++entry) include_children(tree_, entry->first);  // children come after parents
  SubtreeScan scan{root_, std::move(tree_), {}};
  for (const OpenRecord& tile : above_) scan.above.push_back(finished(tile));
  return scan;
}

ErrorTable merge_scans(std::span<const SubtreeScan> scans) {
  RecordTree tree(geo::kFaceCount);
  for (RecordTree::Node& node : tree.nodes()) node.record = kNothingYet;
  for (const SubtreeScan& scan : scans) {
    std::size_t node = scan.root.face;
    for (int level = 0; level < scan.root.level; ++level) {
      include(tree[node].record, scan.above[static_cast<std::size_t>(level)]);
      include(tree[node].record, scan.tree[0].record);
      node = child_node(tree, node, geo::ancestor(scan.root, level + 1));
    }
    graft(tree, node, scan.tree);
  }
  // The levels above the jobs' roots know only what lies below them.
  for (std::size_t node = tree.size(); node-- > 0;) include_children(tree, node);
  return ErrorTable(std::move(tree));
}

}  // namespace tellurion::surface
