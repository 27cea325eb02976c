// One view of a globe: loads what its camera needs, draws it, measures it. Lives on the render thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "base/result.h"
#include "base/time.h"
#include "globe/frame_stats.h"
#include "globe/globe.h"
#include "gpu/render_thread.h"
#include "render/renderer.h"
#include "surface/tile_tree.h"
#include "view/camera.h"

namespace tellurion::globe {

/// What a view shows and how well. Everything may change from frame to frame.
struct ViewSettings {
  double sse_px = 1.0;
  double exaggeration = 1.0;
  surface::LodMetric lod = surface::LodMetric::screen_space_error;
  std::optional<UtcTime> time;   ///< sets the sun; without it the light comes from the upper left of a north-up map under the eye
  bool lighting = true;
  bool atmosphere = true;
  bool wireframe = false;
  bool bounds = false;
  bool tile_borders = false;
  bool antialiasing = false;
  double anisotropy = 1.0;
  glm::vec3 clear{0.0f};         ///< encoded RGB in [0, 1]
  bool transitions = false;      ///< fade and morph between levels
  bool frozen = false;           ///< keep the cut of the last frame
};

class GlobeView {
 public:
  /// Loads the six root tiles, so that no frame ever has a hole. `globe` and `thread` outlive the view.
  static Result<std::unique_ptr<GlobeView>> create(Globe& globe, gpu::RenderThread& thread, std::size_t gpu_budget_bytes);
  ~GlobeView();

  /// One frame: takes over what the workers finished (for at most `upload_ms`), chooses, asks for more, draws into `framebuffer`.
  const FrameStats& draw(const view::Camera& camera, const ViewSettings& settings, unsigned framebuffer = 0, double upload_ms = 4.0);

  /// The same without drawing.
  const FrameStats& update(const view::Camera& camera, const ViewSettings& settings, double upload_ms = 4.0);

  /// Loads until the picture is finished: true; or until `deadline` or nothing more can be had: false.
  bool finish(const view::Camera& camera, const ViewSettings& settings, std::chrono::steady_clock::time_point deadline);

  /// The picture as it is now, without loading anything (row 0 on top).
  raster::Image picture(const view::Camera& camera, const ViewSettings& settings);
  /// What the last `draw` or `picture` drew, without drawing it again.
  raster::Image last_picture();
  render::GeoPicture measure(const view::Camera& camera, const ViewSettings& settings);

  /// Compiles for one look that a single switch makes of `settings`, so that switching it does not stall a frame; false if all
  /// of them are ready. For moments at which a frame may take longer.
  bool prepare_switches(const ViewSettings& settings);

  /// The drawn surface's point that `pixel` (continuous, row 0 on top) shows; nothing for the sky. Costs a small pass: for clicks.
  std::optional<geo::Point<geo::Ecef>> pick(const view::Camera& camera, glm::dvec2 pixel, const ViewSettings& settings);

  /// Ground height under the eye as last looked up by a worker (asks for the next look-up); nothing before the first answer.
  std::optional<EllipsoidalHeight> ground_below(const view::Camera& camera);

  const FrameStats& stats() const;
  /// Parts of tiles that workers read and compose at the moment.
  int parts_in_work() const;
  gpu::RenderThread& thread();
  render::Renderer& renderer();

 private:
  struct State;
  explicit GlobeView(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tellurion::globe
