// The panel that changes what is shown and how.
#include <fmt/format.h>
#include <imgui.h>

#include <cmath>

#include "viewer/panels.h"

namespace tellurion::apps {
namespace {

constexpr float kSettingsWidth = 330.0f;
constexpr float kLabelWidth = 130.0f;

/// A slider over doubles with its label on the left.
void slider(const char* label, double& value, double least, double most, const char* format, bool logarithmic) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted(label);
  ImGui::SameLine(kLabelWidth);
  ImGui::SetNextItemWidth(-1.0f);
  const ImGuiSliderFlags flags = ImGuiSliderFlags_AlwaysClamp | (logarithmic ? ImGuiSliderFlags_Logarithmic : 0);
  ImGui::PushID(label);
  ImGui::SliderScalar("##value", ImGuiDataType_Double, &value, &least, &most, format, flags);
  ImGui::PopID();
}

void picture_part(globe::ViewSettings& view) {
  slider("error allowed", view.sse_px, 0.25, 16.0, "%.2f px", true);
  slider("exaggeration", view.exaggeration, 1.0, 100.0, "%.1f x", true);
  slider("anisotropy", view.anisotropy, 1.0, 16.0, "%.0f x", true);
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted("levels by");
  ImGui::SameLine(kLabelWidth);
  ImGui::SetNextItemWidth(-1.0f);
  int lod = static_cast<int>(view.lod);
  if (ImGui::Combo("##lod", &lod, "screen-space error\0distance\0solid angle\0"))
    view.lod = static_cast<surface::LodMetric>(lod);

  if (!ImGui::BeginTable("switches", 2, ImGuiTableFlags_SizingStretchSame)) return;
  const auto check = [](const char* label, bool& on) {
    ImGui::TableNextColumn();
    ImGui::Checkbox(label, &on);
  };
  check("sun shading", view.lighting);
  check("atmosphere", view.atmosphere);
  check("antialiasing", view.antialiasing);
  check("soft changes", view.transitions);
  check("wireframe", view.wireframe);
  check("bounding boxes", view.bounds);
  check("tile borders", view.tile_borders);
  check("freeze tiles", view.frozen);
  ImGui::EndTable();
}

void clock_part(WorldClock& clock) {
  bool by_time = clock.time.has_value();
  if (ImGui::Checkbox("sun as the clock says", &by_time)) {
    if (by_time)
      clock.time = std::chrono::time_point_cast<std::chrono::milliseconds>(std::chrono::system_clock::now());
    else
      clock = WorldClock();
  }
  if (!clock.time) {
    ImGui::TextDisabled("light from the north-west");
    return;
  }
  ImGui::Text("%s", format_utc(std::chrono::floor<std::chrono::seconds>(*clock.time)).c_str());
  const auto shift = [&clock](const char* label, std::chrono::hours by) {
    ImGui::SameLine();
    if (ImGui::SmallButton(label)) *clock.time += by;
  };
  shift("-1 h", std::chrono::hours(-1));
  shift("+1 h", std::chrono::hours(1));
  shift("-30 d", std::chrono::hours(-720));
  shift("+30 d", std::chrono::hours(720));
  ImGui::Checkbox("running", &clock.running);
  slider("clock rate", clock.rate, 1.0, 86400.0, "%.0f x", true);
}

void motion_part(MotionSettings& motion) {
  slider("wheel step", motion.wheel_step, 0.02, 0.5, "%.2f", false);
  slider("friction", motion.friction, 1.0, 20.0, "%.1f /s", true);
  slider("speed of keys", motion.key_speed, 0.05, 1.0, "%.2f", false);
  slider("least height", motion.least_height_m, 1.0, 1000.0, "%.0f m", true);
}

}  // namespace

void Panels::settings(ViewerState& state) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({display.x - 320.0f, 52.0f}, ImGuiCond_FirstUseEver, {1.0f, 0.0f});
  ImGui::SetNextWindowSize({kSettingsWidth, 0.0f}, ImGuiCond_Always);
  const ImGuiWindowFlags flags = ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoResize;
  if (ImGui::Begin("Settings", &state.shown.settings, flags)) {
    ImGui::TextDisabled("PICTURE");
    picture_part(state.view);
    ImGui::Separator();
    ImGui::TextDisabled("TIME");
    clock_part(state.clock);
    ImGui::Separator();
    ImGui::TextDisabled("MOTION");
    motion_part(state.motion);
  }
  ImGui::End();
}

}  // namespace tellurion::apps
