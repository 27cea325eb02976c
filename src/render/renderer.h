// Turns a drawn cut into pixels: owns the GPU tiles, composes colour slots, draws the passes, reads pictures back.
// Everything needs the render thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "base/result.h"
#include "geo/ellipsoid.h"
#include "gpu/render_thread.h"
#include "raster/image.h"
#include "surface/draw_list.h"
#include "surface/tile_content.h"
#include "surface/tile_tree.h"
#include "view/camera.h"

namespace tellurion::render {

/// An atmosphere that thins exponentially with height. The default is the Earth's.
struct Air {
  double scale_height_m = 8000.0;
  glm::dvec3 scattering_per_m{5.8e-6, 13.5e-6, 33.1e-6};  ///< by molecules at height 0: red, green, blue
  double haze_per_m = 2.0e-6;                             ///< grey scattering, mostly forwards
  glm::dvec3 absorption_per_m{1.2e-6, 3.5e-6, 0.2e-6};    ///< by ozone, its column spread over the scale height
  double top_m = 100e3;                                   ///< nothing is drawn above
  double brightness = 15.0;                               ///< of the scattered light, 1 leaving a pixel at 1 - 1/e
};

/// What tiles may have beside colours.
struct OptionalSlots {
  bool overlays = false;
  bool normals = false;
};

struct RendererOptions {
  geo::Ellipsoid ellipsoid;
  std::optional<Air> air = Air{};                         ///< nothing: FrameLook::atmosphere has no effect
  std::size_t gpu_budget_bytes = std::size_t{512} << 20;  ///< slots, meshes and targets together
  OptionalSlots slots{};
};

/// How a frame looks. All of it may change from frame to frame without a stall.
struct FrameLook {
  double exaggeration = 1.0;
  bool lighting = true;
  bool atmosphere = true;
  bool wireframe = false;     ///< triangles' edges, coloured by level
  bool bounds = false;        ///< the tiles' bounding boxes
  bool tile_borders = false;
  bool antialiasing = false;  ///< 4 samples a pixel
  double anisotropy = 1.0;
  glm::vec3 clear{0.0f};      ///< encoded RGB in [0, 1]
  geo::Vector<geo::Ecef> to_sun{{1.0, 0.0, 0.0}};  ///< unit direction
};

struct FrameFigures {
  int draws = 0;
  std::int64_t triangles = 0;
};

/// What a picture shows, row 0 on top: geodetic latitude, longitude (degrees), height (m) and distance (m); NaN: sky.
struct GeoPicture {
  int width = 0;
  int height = 0;
  std::vector<double> latitude, longitude, elevation, distance;
};

class Renderer {
 public:
  /// Compiles the programs that every frame needs. Errors: unsupported (context too old), internal (shader log).
  static Result<std::unique_ptr<Renderer>> create(gpu::RenderThread& thread, const RendererOptions& options);
  ~Renderer();

  // Residency. An upload that does not fit gives `exhausted`: release something first.
  Result<void> upload_geometry(gpu::RenderThread& thread, const geo::TileKey& key, const surface::TileGeometry& geometry);
  /// `fades`: a slot that is there is faded over, as advance_renewals goes on, if there is room for both.
  Result<void> upload_colour(gpu::RenderThread& thread, const geo::TileKey& key, const surface::TileImagery& imagery, bool fades = false);
  /// Goes on with such fades by this share of the whole.
  void advance_renewals(gpu::RenderThread& thread, float share);
  void release(gpu::RenderThread& thread, const geo::TileKey& key, surface::Part part);
  std::size_t gpu_bytes() const;             ///< resident tiles, targets and pools in use
  std::size_t gpu_budget_bytes() const;
  std::uint64_t bytes_uploaded() const;      ///< since creation
  std::size_t colour_slots_free() const;

  /// From now on tiles may have these too; the next frame may have to compile for that.
  void allow(gpu::RenderThread& thread, const OptionalSlots& slots);

  /// Compiles what `look` needs, so that the first frame with it does not stall; false if that was done before.
  bool warm_up(gpu::RenderThread& thread, const FrameLook& look);

  /// Draws into `framebuffer` (0: the context's own) of the camera's size.
  FrameFigures draw(gpu::RenderThread& thread, const view::Camera& camera, const FrameLook& look,
                    std::span<const surface::DrawTile> tiles, unsigned framebuffer = 0);

  /// Draws into an own target and reads it back (alpha 255).
  raster::Image picture(gpu::RenderThread& thread, const view::Camera& camera, const FrameLook& look,
                        std::span<const surface::DrawTile> tiles);
  /// What the last `draw` or `picture` drew, without drawing it again; empty if there was none.
  raster::Image last_picture(gpu::RenderThread& thread);

  /// What the picture shows, measured from the depth buffer of an own pass without antialiasing.
  GeoPicture measure(gpu::RenderThread& thread, const view::Camera& camera, const FrameLook& look,
                     std::span<const surface::DrawTile> tiles);

 private:
  struct State;
  explicit Renderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tellurion::render
