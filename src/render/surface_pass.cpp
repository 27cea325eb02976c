#include "render/surface_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include <epoxy/gl.h>

#include "render/pass_source.h"
#include "surface/tile_grid.h"

namespace tellurion::render {
namespace {

using surface::DrawTile;

/// What a tile adds to the features of all; bits of a variant's index.
enum TileVariant : std::uint32_t { kFades = 1, kShines = 2, kOverlaid = 4, kInclined = 8 };

constexpr int kTileVectors = 9;  // u_tile of shaders/surface.vert

/// Hands triangles to a software rasteriser in portions: it draws some while the next are set up, and keeps some 280 bytes of
/// each until it has drawn it, so that no more than a few portions may wait.
class Portions {
 public:
  explicit Portions(bool wanted) : wanted_(wanted) {}
  ~Portions() {
    for (const GLsync sync : waiting_) glDeleteSync(sync);
  }
  Portions(const Portions&) = delete;
  Portions& operator=(const Portions&) = delete;

  void add(std::int64_t triangles) {
    constexpr std::int64_t kTriangles = 6'000;
    constexpr GLuint64 kLongestWait_ns = 1'000'000'000;
    triangles_ += triangles;
    if (!wanted_ || triangles_ < kTriangles) return;
    triangles_ = 0;
    const GLsync oldest = std::exchange(waiting_[next_], glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0));
    next_ = (next_ + 1) % waiting_.size();
    glFlush();
    if (oldest == nullptr) return;
    glClientWaitSync(oldest, 0, kLongestWait_ns);
    glDeleteSync(oldest);
  }

 private:
  bool wanted_;
  std::int64_t triangles_ = 0;
  std::array<GLsync, 4> waiting_{};
  std::size_t next_ = 0;
};

/// Scale and offset from the tile coordinates of `tile` to texture coordinates of the slot of `owner`.
glm::vec4 slot_place(const geo::TileKey& tile, const geo::TileKey& owner, int side, int gutter, float layer) {
  const int levels = tile.level - owner.level;
  const double part = std::ldexp(1.0, -levels);  // of the owner's side
  const double inner = static_cast<double>(side - 2 * gutter) / side;
  const double edge = static_cast<double>(gutter) / side;
  const auto first_x = static_cast<std::int64_t>(owner.x) << levels;
  const auto first_y = static_cast<std::int64_t>(owner.y) << levels;
  return {part * inner, edge + inner * part * static_cast<double>(tile.x - first_x),
          edge + inner * part * static_cast<double>(tile.y - first_y), layer};
}

/// Whether of a tile's effects some may be seen: lights where it is dark somewhere, water where it mirrors the sun into the eye
/// (see shaders/surface.frag). `owner` has the slot; `up`: at the middle of the drawn tile, `origin` its origin seen from the eye, metres.
bool shows_effects(const ResidentTile& owner, const glm::dvec3& up, int level, const glm::dvec3& origin, const glm::dvec3& to_sun) {
  constexpr double kNightBegins = 0.02, kGlintEnds = 0.55;  // sine of the sun's height; radians from the mirror's direction
  if (!owner.effects) return false;
  const double reach = std::ldexp(1.2, -level);  // radians: more than from its middle to a corner
  if (owner.has_night && glm::dot(up, to_sun) < kNightBegins + reach) return true;
  if (!owner.has_water) return false;
  constexpr double kRadius = 7e6;  // metres, as large as the Earth's at least: only how far effects are looked for depends on it
  const double distance = glm::length(origin), radius = reach * kRadius;
  if (radius >= distance) return true;
  const glm::dvec3 half_way = to_sun - origin / distance;
  const double length = std::max(glm::length(half_way), 1e-3);
  const double turn = std::asin(radius / distance) / length;  // of the half-way vector, within the tile
  return glm::dot(half_way, up) > length * std::cos(std::min(kGlintEnds + reach + turn, 3.14));
}

/// Whether the normals of the tile `owner` are finer than the slopes of a tile of `slope_level`, whose texels measure half to one of the
/// elevation's spacings.
bool shows_normals(const ResidentTile& owner, int slope_level, const geo::Ellipsoid& ellipsoid) {
  return owner.normals && owner.normals_spacing < 2.0 * surface::nominal_slope_texel(ellipsoid, slope_level);
}

struct TileUniforms {
  glm::vec4 v[kTileVectors];
};

gpu::ProgramSource surface_source() {
  return {shader_texts({"frame.glsl", "atmosphere.glsl", "surface.vert"}),
          shader_texts({"frame.glsl", "surface.frag"}),
          {"LIGHT", "ATMOSPHERE", "FADE", "BORDERS", "WIREFRAME", "MEASURE", "LOG_DEPTH", "EFFECTS", "OVERLAY", "NORMALS"},
          {"u_tile"},
          {"u_colour", "u_slope", "u_before", "u_effects", "u_overlay", "u_normals"},
          {"Frame"}};
}

gpu::ProgramSource box_source() {
  return {shader_texts({"frame.glsl", "box.vert"}), shader_texts({"box.frag"}), {"LOG_DEPTH"}, {"u_box"}, {}, {"Frame"}};
}

}  // namespace

SurfacePass::SurfacePass(gpu::RenderThread& thread, const geo::Ellipsoid& ellipsoid)
    : ellipsoid_(ellipsoid),
      programs_(surface_source()),
      box_programs_(box_source()),
      box_array_(thread),
      box_edges_(thread),
      colour_sampler_(thread) {
  constexpr std::uint8_t kEdges[24] = {0, 1, 2, 3, 4, 5, 6, 7, 0, 2, 1, 3, 4, 6, 5, 7, 0, 4, 1, 5, 2, 6, 3, 7};
  glBindVertexArray(box_array_.name());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, box_edges_.name());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, sizeof kEdges, kEdges, GL_STATIC_DRAW);
  glBindVertexArray(0);
  const unsigned sampler = colour_sampler_.name();
  glSamplerParameteri(sampler, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glSamplerParameteri(sampler, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glSamplerParameteri(sampler, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glSamplerParameteri(sampler, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

Result<void> SurfacePass::prepare(gpu::RenderThread& thread, std::uint32_t features) {
  const auto programs = variants(thread, features);
  if (!programs) return programs.error();
  return {};
}

Result<SurfacePass::Variants> SurfacePass::variants(gpu::RenderThread& thread, std::uint32_t features) {
  const bool coloured = !(features & (measure | wireframe)), overlaid = coloured && (features & overlay);
  const bool shines = coloured && (features & light), inclined = shines && (features & normals);  // effects and normals matter to light only
  Variants programs{};
  for (std::uint32_t i = 0; i < programs.size(); ++i) {
    const std::uint32_t added = (coloured && (i & kFades) ? fade : 0u) | (shines && (i & kShines) ? effects : 0u) | (overlaid && (i & kOverlaid) ? overlay : 0u) |
                                (inclined && (i & kInclined) ? normals : 0u);
    const auto program = programs_.variant(thread, (features & ~(overlay | normals)) | added);
    if (!program) return program.error();
    programs[i] = *program;
  }
  return programs;
}

void SurfacePass::set_anisotropy(const gpu::RenderThread& thread, double anisotropy) {
  const auto& capabilities = thread.capabilities();
  if (!capabilities.anisotropic_filter) return;
  const float wanted = std::clamp(static_cast<float>(anisotropy), 1.0f, capabilities.max_anisotropy);
  if (wanted == anisotropy_) return;
  glSamplerParameterf(colour_sampler_.name(), GL_TEXTURE_MAX_ANISOTROPY_EXT, wanted);
  anisotropy_ = wanted;
}

void SurfacePass::bind(unsigned unit, unsigned texture) {
  if (bound_[unit] == texture) return;
  glActiveTexture(GL_TEXTURE0 + unit);
  glBindTexture(GL_TEXTURE_2D_ARRAY, texture);
  bound_[unit] = texture;
}

FrameFigures SurfacePass::draw(gpu::RenderThread& thread, const view::Camera& camera, double exaggeration,
                               const glm::dvec3& to_sun, std::uint32_t features, std::span<const DrawTile> tiles, const TileStore& store) {
  const auto programs = variants(thread, features);
  if (!programs) return {};

  glBindSampler(1, 0);
  for (const unsigned unit : {0u, 2u, 3u, 4u, 5u}) glBindSampler(unit, colour_sampler_.name());
  std::fill(std::begin(bound_), std::end(bound_), 0u);

  FrameFigures figures;
  Portions portions(thread.capabilities().is_software);
  const gpu::LinkedProgram* in_use = nullptr;
  for (const DrawTile& tile : tiles) {
    const ResidentTile* resident = store.find(tile.key);
    if (!resident || !resident->mesh) continue;
    ResidentMesh& mesh = *resident->mesh;

    const auto colour_owner = tile.colour_owner == tile.key ? resident : store.find(tile.colour_owner);
    const bool fades = tile.fade < 1.0f && tile.colour_before != tile.colour_owner;
    const bool renews = !fades && colour_owner && colour_owner->colour_before;
    const glm::dvec3 offset = mesh.origin(exaggeration) - camera.eye.xyz;
    const bool has_effects = colour_owner && shows_effects(*colour_owner, mesh.origin_up(), tile.key.level, offset, to_sun);
    const bool has_overlay = colour_owner && colour_owner->overlay;
    const bool has_normals = colour_owner && shows_normals(*colour_owner, tile.slope_owner.level, ellipsoid_);
    const gpu::LinkedProgram* program =
        (*programs)[(fades || renews ? kFades : 0u) + (has_effects ? kShines : 0u) + (has_overlay ? kOverlaid : 0u) +
                     (has_normals ? kInclined : 0u)];
    if (program != in_use) {
      glUseProgram(program->program.name());
      in_use = program;
    }

    const glm::vec3 upper(offset);
    const glm::vec3 lower(offset - glm::dvec3(upper));
    const auto slope_owner = tile.slope_owner == tile.key ? resident : store.find(tile.slope_owner);
    const auto colour = store.colour_of(colour_owner);
    const auto slopes = store.slopes_of(slope_owner);
    TileUniforms u;
    u.v[0] = glm::vec4(upper, mesh.reference_height());
    u.v[1] = glm::vec4(lower, tile.morph);
    u.v[2] = glm::vec4(glm::vec3(mesh.origin_up()), tile.skirt_depth);
    u.v[3] = glm::vec4(glm::vec3(slope_owner ? slope_owner->tangent : resident->tangent), tile.key.level);
    u.v[4] = slot_place(tile.key, tile.colour_owner, surface::kColourSlotSide, surface::kColourGutter, colour.layer);
    u.v[5] = slot_place(tile.key, tile.slope_owner, surface::kSlopeSlotSide, surface::kSlopeGutter, slopes.layer);
    u.v[6] = u.v[4];
    u.v[7] = glm::vec4(renews ? colour_owner->renewal : tile.fade, tile.sink_depth, tile.sink_level, 0);
    if (has_effects) {
      const auto layer = store.effects_of(*colour_owner);
      u.v[7].w = layer.layer;
      bind(3, layer.texture);
    }
    u.v[8] = glm::vec4(0);
    if (has_overlay) {
      const auto layer = store.overlay_of(*colour_owner);
      u.v[8].x = layer.layer;
      bind(4, layer.texture);
    }
    if (has_normals) {
      const auto layer = store.normals_of(*colour_owner);
      u.v[8].y = layer.layer;
      bind(5, layer.texture);
    }
    bind(0, colour.texture);
    bind(1, slopes.texture);
    if (fades || renews) {
      const geo::TileKey before_owner = renews ? tile.colour_owner : tile.colour_before;
      const auto before = renews ? store.colour_before_of(*colour_owner) : store.colour_of(store.find(before_owner));
      u.v[6] = slot_place(tile.key, before_owner, surface::kColourSlotSide, surface::kColourGutter, before.layer);
      bind(2, before.texture);
    }
    glUniform4fv(program->locations[0], kTileVectors, &u.v[0].x);

    if (features & wireframe) {
      mesh.draw_lines(thread, tile.step);
    } else {
      mesh.draw_triangles(tile.step);
      const std::int64_t triangles = mesh.index_count(tile.step) / 3;
      figures.triangles += triangles;
      portions.add(triangles);
    }
    ++figures.draws;
  }
  glBindVertexArray(0);
  for (GLuint unit = 0; unit < 6; ++unit) glBindSampler(unit, 0);
  return figures;
}

void SurfacePass::draw_boxes(gpu::RenderThread& thread, const view::Camera& camera, double exaggeration,
                             std::uint32_t features, std::span<const DrawTile> tiles, const TileStore& store) {
  const auto program = box_programs_.variant(thread, features & log_depth ? 1u : 0u);
  if (!program) return;
  glUseProgram((*program)->program.name());
  glBindVertexArray(box_array_.name());
  for (const DrawTile& tile : tiles) {
    const ResidentTile* resident = store.find(tile.key);
    if (!resident || !resident->mesh) continue;
    const auto box = resident->mesh->box(exaggeration);
    glm::vec4 u[4] = {glm::vec4(box.corner - camera.eye.xyz, 0.0)};
    for (int axis = 0; axis < 3; ++axis) u[axis + 1] = glm::vec4(box.edges[axis], 0.0);
    glUniform4fv((*program)->locations[0], 4, &u[0].x);
    glDrawElements(GL_LINES, 24, GL_UNSIGNED_BYTE, nullptr);
  }
  glBindVertexArray(0);
}

}  // namespace tellurion::render
