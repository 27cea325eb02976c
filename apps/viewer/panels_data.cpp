// The panels that only show: statistics and layers.
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/panel_kit.h"
#include "viewer/panels.h"

namespace tellurion::apps {
namespace {

constexpr float kStatisticsWidth = 290.0f;
constexpr float kLayersWidth = 420.0f;
const ImVec4 kErrorColour{1.0f, 0.55f, 0.45f, 1.0f};

/// "3:12 4:25": what there is of each level.
std::string by_level(const std::vector<int>& counts) {
  std::string text;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    if (counts[level] > 0) text += fmt::format("{}{}:{}", text.empty() ? "" : "  ", level, counts[level]);
  }
  return text.empty() ? "none" : text;
}

void raster_rows(const source::RasterDescription& raster) {
  const auto& full = raster.levels.front();
  table_row("size", fmt::format("{} x {}, {} levels", full.width, full.height, raster.levels.size()));
  table_row("samples",
            fmt::format("{}, {} {}", raster.sample_type, raster.band_count, raster.band_count == 1 ? "band" : "bands"));
  table_row("spacing", text_of_metres(raster.spacing.value));
  table_row("projection", raster.crs_name);
  if (raster.kind == source::SampleKind::height)
    table_row("vertical datum", raster.vertical_declared ? raster.vertical : raster.vertical + " (assumed)");
}

void catalogue_rows(const globe::CatalogueFacts& facts) {
  table_row("rasters", facts.to_look_into == 0 ? fmt::format("{}", facts.rasters) : fmt::format("{}, {} more to be looked into", facts.rasters, facts.to_look_into));
  if (facts.rasters > 0) table_row("spacing", fmt::format("{:.4g} to {:.4g} m", facts.finest.value, facts.coarsest.value));
}

/// Sliders for what may be changed of a layer. Whether something was.
bool settings_rows(globe::LayerSettings& settings, globe::LayerGroup group) {
  const auto slider = [](const char* name, double& value, double least, double most, ImGuiSliderFlags flags = 0) {
    return ImGui::SliderScalar(name, ImGuiDataType_Double, &value, &least, &most, "%.2f", flags | ImGuiSliderFlags_AlwaysClamp);
  };
  const bool is_height = group == globe::LayerGroup::height;
  bool changed = is_height ? ImGui::Checkbox("added to the heights below", &settings.adds) : slider("opacity", settings.opacity, 0.0, 1.0);
  changed |= slider("feather", settings.feather, 0.0, std::max(200.0, settings.feather), ImGuiSliderFlags_Logarithmic);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("fades in from its edges over so many pixels of the data");
  if (is_height) return changed;
  if (group == globe::LayerGroup::normal) return changed;
  changed |= slider("gamma", settings.gamma, 0.1, 10.0, ImGuiSliderFlags_Logarithmic);
  changed |= slider("multiplier", settings.multiplier, 0.0, 4.0);
  return changed;
}

struct LayerState {
  globe::SourceStats stats;
  std::string step;
  std::optional<globe::CatalogueFacts> catalogue;
  std::shared_ptr<const source::RasterSource> raster;
};

void layer_details(const globe::LayerInfo& layer, const LayerState& state) {
  ImGui::PushTextWrapPos(0.0f);
  const std::string place = state.raster ? state.raster->description().name : layer.spec.source.path.string();
  ImGui::TextWrapped("%s", place.c_str());
  if (ImGui::BeginTable("figures", 2, ImGuiTableFlags_SizingStretchProp)) {
    if (!state.step.empty()) table_row("time", state.step);
    if (state.raster) raster_rows(state.raster->description());
    if (state.catalogue) catalogue_rows(*state.catalogue);
    table_row("read", fmt::format("{} in {} requests", text_of_bytes(static_cast<double>(state.stats.bytes)), state.stats.requests));
    if (state.stats.errors > 0) table_row("errors", std::to_string(state.stats.errors));
    ImGui::EndTable();
  }
  if (!layer.error.empty())
    ImGui::TextWrapped("%s", layer.error.c_str());
  else if (!state.stats.last_error.empty())
    ImGui::TextWrapped("%s", state.stats.last_error.c_str());
  if (state.raster) {
    for (const std::string& hint : state.raster->description().hints)
      ImGui::TextColored({1.0f, 0.80f, 0.40f, 1.0f}, "%s", hint.c_str());
  }
  ImGui::PopTextWrapPos();
}

/// A layer's switch, place and settings.
void layer_entry(globe::Globe& globe, std::size_t i, const LayerState& state, bool may_rise, bool may_sink, Asked& asked) {
  const globe::LayerInfo& layer = globe.layer(i);
  globe::LayerSettings settings = globe.layer_settings(i);
  bool changed = ImGui::Checkbox("##on", &settings.enabled);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("shown or not");
  const auto arrow = [&](const char* name, ImGuiDir direction, bool can, bool up) {
    ImGui::SameLine();
    ImGui::BeginDisabled(!can);
    if (ImGui::ArrowButton(name, direction)) globe.move_layer(i, up);
    ImGui::EndDisabled();
  };
  arrow("##up", ImGuiDir_Up, may_rise, true);
  arrow("##down", ImGuiDir_Down, may_sink, false);
  ImGui::SameLine();
  const bool failed = !layer.error.empty() || state.stats.errors > 0;
  if (failed) ImGui::PushStyleColor(ImGuiCol_Text, kErrorColour);
  const bool open = ImGui::CollapsingHeader(fmt::format("{} ({})", layer.spec.name, globe::name_of(layer.spec.group)).c_str(), ImGuiTreeNodeFlags_DefaultOpen);
  if (failed) ImGui::PopStyleColor();
  if (open) {
    changed |= settings_rows(settings, layer.spec.group);
    if (ImGui::SmallButton("Fly to")) asked.fly_to = i;
    ImGui::SameLine();
    const bool removed = ImGui::SmallButton("Remove");
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("for this run; Save removes it from the world file");
    if (removed) return (void)globe.remove_layer(i);
    layer_details(layer, state);
  }
  if (changed) (void)globe.set_layer(i, settings);  // the sliders keep to the ranges
}

}  // namespace

/// What the network brings, and what each of its sources did; nothing where no layer needs it.
void Panels::loader(const globe::Globe& globe) {
  std::vector<std::size_t> remote = globe.layer_order();
  std::erase_if(remote, [&](std::size_t i) {
    const auto raster = globe.shown_raster(i);
    return !raster || !raster->description().is_remote;
  });
  if (remote.empty()) return;
  std::ranges::sort(remote);
  ImGui::Separator();
  ImGui::TextDisabled("network");
  const fetch::FetchStats fetched = globe.fetch_stats();
  const double rate = fetched_.of(static_cast<double>(fetched.bytes), std::chrono::steady_clock::now());
  if (ImGui::BeginTable("network", 2, ImGuiTableFlags_SizingStretchProp)) {
    table_row("waiting, in flight", fmt::format("{}, {}", fetched.waiting, fetched.in_flight));
    table_row("requests", std::to_string(fetched.started));
    table_row("cancelled, failed", fmt::format("{}, {}", fetched.cancelled, fetched.failed));
    table_row("bytes", fmt::format("{}, {}/s", text_of_bytes(static_cast<double>(fetched.bytes)), text_of_bytes(rate)));
    ImGui::EndTable();
  }
  const auto stats = globe.source_stats();  // by number, of no fewer layers
  for (const std::size_t i : remote) {
    const globe::SourceStats& s = stats[i];
    ImGui::TextWrapped("%s", s.name.c_str());
    ImGui::TextDisabled("%s", fmt::format("  {} reads, {}, {} errors", s.requests, text_of_bytes(static_cast<double>(s.bytes)), s.errors).c_str());
    if (s.last_error.empty()) continue;
    ImGui::PushStyleColor(ImGuiCol_Text, kErrorColour);
    ImGui::TextWrapped("%s", s.last_error.c_str());
    ImGui::PopStyleColor();
  }
}

void Panels::statistics(const globe::Globe& globe, const globe::FrameStats& s, bool& shown) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({display.x - 10.0f, 52.0f}, ImGuiCond_FirstUseEver, {1.0f, 0.0f});
  ImGui::SetNextWindowSize({kStatisticsWidth, 0.0f}, ImGuiCond_Always);
  if (ImGui::Begin("Statistics", &shown, ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoResize)) {
    const float slowest = *std::max_element(frame_ms_.begin(), frame_ms_.end());
    ImGui::Text("%.1f ms", s.frame_ms);
    ImGui::SameLine();
    ImGui::TextDisabled("at most %.0f ms in %zu frames", static_cast<double>(slowest), kGraphFrames);
    ImGui::PlotLines("##frames", frame_ms_.data(), static_cast<int>(frame_ms_.size()), static_cast<int>(next_frame_),
                     nullptr, 0.0f, std::max(40.0f, 1.2f * slowest), {ImGui::GetContentRegionAvail().x, 64.0f});
    if (ImGui::BeginTable("figures", 2, ImGuiTableFlags_SizingStretchProp)) {
      const auto count = [](auto n) { return fmt::format("{}", n); };
      const auto bytes = [](std::int64_t n) { return text_of_bytes(static_cast<double>(n)); };
      table_row("frame", count(s.frame));
      table_row("select, upload, draw", fmt::format("{:.2f}, {:.1f}, {:.1f} ms", s.select_ms, s.upload_ms, s.draw_ms));
      table_row("frames over 33 ms", count(s.frames_over_budget));
      table_row("tiles visited", count(s.tiles_visited));
      table_row("tiles selected", count(s.tiles_selected));
      table_row("tiles drawn", count(s.tiles_drawn));
      table_row("tiles waiting", count(s.tiles_waiting));
      table_row("triangles", count(s.triangles));
      table_row("draws", count(s.draws));
      table_row("largest error", fmt::format("{:.2f} px", s.max_error_px));
      table_row("requests", count(s.requests));
      table_row("cancelled", count(s.requests_cancelled));
      table_row("fetched", bytes(s.bytes_fetched));
      table_row("uploaded", bytes(s.bytes_uploaded));
      table_row("memory cache", bytes(s.memory_cache_bytes));
      table_row("GPU cache", bytes(s.gpu_cache_bytes));
      table_row("disk cache", bytes(s.disk_cache_bytes));
      table_row("resident", bytes(globe::resident_bytes()));
      table_row("picture", s.complete ? "complete" : "loading");
      ImGui::EndTable();
    }
    ImGui::Separator();
    ImGui::TextDisabled("drawn, level:tiles");
    ImGui::TextWrapped("%s", by_level(s.tiles_drawn_by_level).c_str());
    loader(globe);
  }
  ImGui::End();
}

/// The uppermost first.
void Panels::layers(globe::Globe& globe, ViewerState& state, Asked& asked) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({10.0f, 52.0f}, ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSize({kLayersWidth, std::min(520.0f, display.y - 110.0f)}, ImGuiCond_FirstUseEver);
  if (ImGui::Begin("Layers", &state.shown.layers, ImGuiWindowFlags_NoCollapse)) {
    const std::vector<std::size_t> order = globe.layer_order();
    const auto stats = globe.source_stats();  // by number, of no fewer layers
    ImGui::TextUnformatted(globe.world().planet.c_str());
    ImGui::SameLine();
    if (ImGui::SmallButton("Save")) asked.command = Command::save_layers;
    if (const auto file = globe.kept_layers().file; !file.empty()) ImGui::TextDisabled("%s", file.string().c_str());
    const auto same_group = [&](std::size_t a, std::size_t b) { return b < order.size() && globe.layer(order[a]).spec.group == globe.layer(order[b]).spec.group; };
    for (std::size_t n = order.size(); n-- > 0;) {
      const std::size_t i = order[n];
      ImGui::PushID(static_cast<int>(i));
      const LayerState now{stats[i], globe.step_of(i, state.view.time), globe::catalogue_facts(globe, i), globe.shown_raster(i)};
      layer_entry(globe, i, now, same_group(n, n + 1), n > 0 && same_group(n, n - 1), asked);
      ImGui::PopID();
    }
  }
  ImGui::End();
}

}  // namespace tellurion::apps
