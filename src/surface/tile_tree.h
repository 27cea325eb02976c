// The cut: which tiles a view wants, which it can draw now, and what to load next.
// One tree serves one view over one surface. Lives on the render thread; no I/O, no OpenGL; no allocation in steady state.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/frozen.h"
#include "geo/ellipsoid.h"
#include "surface/draw_list.h"
#include "surface/surface_facts.h"
#include "surface/tile_content.h"
#include "view/camera.h"

namespace tellurion::surface {

/// The parts of a tile that are loaded on their own.
enum class Part : std::uint8_t { geometry, colour };

enum class LodMetric : std::uint8_t { screen_space_error, distance, solid_angle };

struct SelectionSettings {
  double sse_px = 1.0;            ///< wanted screen-space error
  double exaggeration = 1.0;
  LodMetric metric = LodMetric::screen_space_error;
  double anisotropy = 1.0;        ///< of the texture filter in use
  std::size_t max_tiles = 2000;   ///< selected tiles at most: else the wanted error rises, by a rule of camera and facts alone
  std::size_t max_bytes = std::numeric_limits<std::size_t>::max();  ///< of graphics memory for them, likewise (see bytes_of_tile)
  bool transitions = false;       ///< fade and morph at level changes; off: always the end state
  bool frozen = false;            ///< keep the cut of the last frame (drawn from the given camera)
};

struct TileRequest {
  geo::TileKey key;
  Part part = Part::geometry;
  double gain_px = 0;             ///< screen error that it takes away; requests are sorted by it, greatest first
};

struct SelectionStats {
  int tiles_visited = 0;
  int tiles_selected = 0;
  int tiles_drawn = 0;
  int tiles_waiting = 0;          ///< wanted and not resident
  std::vector<int> selected_by_level;
  std::vector<int> drawn_by_level;
  double max_error_px = 0;        ///< largest error of a drawn tile
  double effective_sse_px = 0;    ///< the wanted error after the rule of max_tiles and max_bytes
  bool retries_later = false;     ///< something wanted failed and will be asked for again
  bool complete = false;          ///< the drawn cut is the selected cut with all its parts, and no transition is under way
};

struct Selection {
  std::vector<DrawTile> draw;         ///< sorted front to back, ties by key
  std::vector<DrawTile> floor;        ///< to be drawn below all of it; empty once complete
  std::vector<TileRequest> requests;  ///< not yet started, at most a few hundred
  SelectionStats stats;
};

/// What a tile takes on the GPU: its mesh, and the slots of its own that its facts tell of, colour with mips.
std::size_t bytes_of_tile(const TileFacts& facts, std::size_t mesh_bytes);

/// How long a fade or morph takes.
inline constexpr std::chrono::duration<float> kTransitionTime{0.3f};

class TileTree {
 public:
  TileTree(const geo::Ellipsoid& ellipsoid, std::shared_ptr<const SurfaceFacts> facts);
  ~TileTree();

  /// New facts (tables have arrived, data sets changed). Resident tiles stay.
  void set_facts(std::shared_ptr<const SurfaceFacts> facts);

  /// Chooses for `camera`. The result is valid until the next call. `now` drives retries and transitions.
  /// The six roots' geometry must be resident (asserted): they make holes impossible. Roots always own colour and slopes,
  /// whatever the facts say; until a root's colour has arrived, tiles without a nearer slot name it nevertheless.
  const Selection& select(const view::Camera& camera, const SelectionSettings& settings,
                          std::chrono::steady_clock::time_point now);

  /// What a later view will ask for besides, the nearest thing to it known: to be loaded while nothing else is wanted. Valid until
  /// the next call; followed by `select` before anything is dropped.
  std::span<const TileRequest> foresee(const view::Camera& camera, const SelectionSettings& settings,
                                       std::chrono::steady_clock::time_point now);

  // The life of a part: wanted -> started -> arrived -> released, or failed (wanted again at `retry_at`).
  void started(const geo::TileKey& key, Part part);
  void cancelled(const geo::TileKey& key, Part part);
  void arrived_geometry(const geo::TileKey& key, const TileMetrics& metrics, bool has_slopes);
  void arrived_colour(const geo::TileKey& key);
  void failed(const geo::TileKey& key, Part part, std::chrono::steady_clock::time_point retry_at);
  void released(const geo::TileKey& key, Part part);
  /// Parts of this kind that failed are wanted again: what they are built from has changed.
  void forget_failures(Part part);

  /// Whether a started request is still of use (asked again by one of the last frames); a loader may drop it if not.
  bool is_wanted(const geo::TileKey& key, Part part) const;
  /// Screen error that it would take away, pixels, as the last frame that wanted it saw it.
  double gain_px(const geo::TileKey& key, Part part) const;

  /// The resident part to drop first: not used by the last frame, least recently used, children before parents, never a root.
  /// Used are all tiles that the last frame visited and saw, so the ancestors of what it draws too.
  std::optional<geo::TileKey> eviction_candidate(Part part) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tellurion::surface
