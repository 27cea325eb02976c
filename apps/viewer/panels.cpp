#include "viewer/panels.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "viewer/panel_kit.h"
#include "viewer/window.h"

namespace tellurion::apps {
namespace {

constexpr float kFontSize = 15.0f;
constexpr float kMargin = 10.0f;
constexpr float kBelowToolbar = 42.0f;
const ImVec4 kAccent{0.33f, 0.62f, 0.86f, 1.0f};
constexpr ImGuiWindowFlags kOverlay = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                                      ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing |
                                      ImGuiWindowFlags_NoNav | ImGuiWindowFlags_NoMove;

void load_font() {
  // Dear ImGui's own font is a bitmap of 13 pixels; these are nicer where they are installed.
  for (const char* file : {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", "/usr/share/fonts/TTF/DejaVuSans.ttf",
                           "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf"}) {
    std::error_code ignored;
    if (std::filesystem::exists(file, ignored) && ImGui::GetIO().Fonts->AddFontFromFileTTF(file, kFontSize)) return;
  }
  ImGui::GetIO().Fonts->AddFontDefault();
}

void dark_translucent_style() {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 6.0f;
  style.FrameRounding = 4.0f;
  style.GrabRounding = 4.0f;
  style.ScrollbarRounding = 6.0f;
  style.WindowBorderSize = 0.0f;
  style.WindowMinSize = {16.0f, 16.0f};
  style.WindowPadding = {12.0f, 10.0f};
  style.FramePadding = {8.0f, 4.0f};
  style.ItemSpacing = {8.0f, 6.0f};
  style.CellPadding = {6.0f, 2.0f};
  style.WindowTitleAlign = {0.0f, 0.5f};
  const auto set = [&style](ImGuiCol which, float r, float g, float b, float a) { style.Colors[which] = {r, g, b, a}; };
  set(ImGuiCol_WindowBg, 0.06f, 0.07f, 0.09f, 0.84f);
  set(ImGuiCol_TitleBg, 0.09f, 0.11f, 0.14f, 0.92f);
  set(ImGuiCol_TitleBgActive, 0.12f, 0.16f, 0.21f, 0.96f);
  set(ImGuiCol_FrameBg, 1.0f, 1.0f, 1.0f, 0.09f);
  set(ImGuiCol_FrameBgHovered, 1.0f, 1.0f, 1.0f, 0.15f);
  set(ImGuiCol_FrameBgActive, 1.0f, 1.0f, 1.0f, 0.20f);
  set(ImGuiCol_Button, 1.0f, 1.0f, 1.0f, 0.10f);
  set(ImGuiCol_ButtonHovered, 0.33f, 0.62f, 0.86f, 0.45f);
  set(ImGuiCol_ButtonActive, 0.33f, 0.62f, 0.86f, 0.70f);
  set(ImGuiCol_Header, 0.33f, 0.62f, 0.86f, 0.25f);
  set(ImGuiCol_HeaderHovered, 0.33f, 0.62f, 0.86f, 0.40f);
  style.Colors[ImGuiCol_CheckMark] = kAccent;
  style.Colors[ImGuiCol_SliderGrab] = kAccent;
  style.Colors[ImGuiCol_PlotLines] = kAccent;
}

/// Puts the next window at a corner or edge of the picture: 0 is left or top, 1 right or bottom.
void anchor(float x, float y, float shift_y = 0.0f) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({kMargin + x * (size.x - 2 * kMargin), kMargin + y * (size.y - 2 * kMargin) + shift_y},
                          ImGuiCond_Always, {x, y});
}

void switch_button(const char* label, const char* tip, bool& on) {
  if (on) ImGui::PushStyleColor(ImGuiCol_Button, {kAccent.x, kAccent.y, kAccent.z, 0.55f});
  const bool was_on = on;
  if (ImGui::Button(label)) on = !on;
  if (was_on) ImGui::PopStyleColor();
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", tip);
  ImGui::SameLine();
}

/// Whom the data are owed to: a line for each source that says so, then the other layers' names.
std::vector<std::string> attributions(const globe::Globe& globe) {
  std::vector<std::string> lines;
  std::string names;
  for (std::size_t i = 0; i < globe.layer_count(); ++i) {
    if (!globe.layer_settings(i).enabled) continue;
    const globe::LayerSpec& spec = globe.layer(i).spec;
    const auto raster = globe.shown_raster(i);
    std::string credit = spec.attribution;
    if (credit.empty() && raster) credit = raster->description().attribution;
    if (credit.empty()) names += (names.empty() ? "" : " \xC2\xB7 ") + spec.name;
    else if (std::find(lines.begin(), lines.end(), credit) == lines.end()) lines.push_back(std::move(credit));
  }
  if (!names.empty()) lines.push_back(std::move(names));
  return lines;
}

std::string status_text(const globe::FrameStats& stats, const Moment& moment) {
  std::string text;
  if (moment.cursor) {
    text = text_of_place(*moment.cursor);
    if (moment.cursor_height_m) text += fmt::format("  {:.0f} m", *moment.cursor_height_m);
    text += "   |   ";
  }
  const double heading = std::fmod(to_degrees(moment.compass).value + 360.0, 360.0);
  text +=
      fmt::format("eye {}  heading {:.0f}\xC2\xB0  tilt {:.0f}\xC2\xB0", text_of_metres(moment.height_above_ground_m),
                  heading, to_degrees(moment.pose.pitch).value + 90.0);
  if (moment.metres_per_pixel > 0.0)
    text += fmt::format("   |   100 px = {}", text_of_metres(100.0 * moment.metres_per_pixel));
  if (!stats.complete)
    text += stats.tiles_waiting > 0 ? fmt::format("   |   loading {}", stats.tiles_waiting) : "   |   preparing data";
  return text;
}

}  // namespace

Panels::Panels(const Window& window) {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // nothing is left behind in the user's folder
  dark_translucent_style();
  load_font();
  ImGui_ImplGlfw_InitForOpenGL(window.handle(), true);
  ImGui_ImplOpenGL3_Init(window.api() == gpu::Api::core ? "#version 410 core" : "#version 300 es");
}

Panels::~Panels() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
}

void Panels::begin() {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
}

bool Panels::take_mouse() const { return ImGui::GetIO().WantCaptureMouse; }
bool Panels::take_keyboard() const { return ImGui::GetIO().WantCaptureKeyboard; }

Asked Panels::draw(globe::Globe& globe, const globe::FrameStats& stats, const Moment& moment, ViewerState& state) {
  frame_ms_[next_frame_] = static_cast<float>(stats.frame_ms);
  next_frame_ = (next_frame_ + 1) % kGraphFrames;
  Asked asked;
  toolbar(state, asked);
  if (state.shown.statistics) statistics(globe, stats, state.shown.statistics);
  if (state.shown.layers) layers(globe, state, asked);
  if (state.shown.settings) settings(state);
  if (state.shown.help) help(state.shown.help);
  activity(moment);
  if (state.shown.hints) hints(globe, state.shown.hints);
  status_line(globe, stats, moment);
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  return asked;
}

void Panels::toolbar(ViewerState& state, Asked& asked) {
  anchor(0.0f, 0.0f);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {6.0f, 6.0f});
  ImGui::Begin("toolbar", nullptr, kOverlay);
  switch_button("Help", "F1", state.shown.help);
  switch_button("Statistics", "F2", state.shown.statistics);
  switch_button("Layers", "F3", state.shown.layers);
  switch_button("Settings", "F4", state.shown.settings);
  if (ImGui::Button("Home")) asked.command = Command::home;
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("H");
  ImGui::SameLine();
  if (ImGui::Button("North")) asked.command = Command::north_up;
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("N");
  ImGui::End();
  ImGui::PopStyleVar();
}

void Panels::help(bool& shown) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({size.x / 2, size.y / 2}, ImGuiCond_Appearing, {0.5f, 0.5f});
  if (ImGui::Begin("Help", &shown, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse)) {
    const auto cells = [](const char* label, const char* effect) {
      ImGui::TableNextColumn();
      ImGui::TextColored(kAccent, "%s", label);
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(effect);
    };
    if (ImGui::BeginTable("gestures", 2, ImGuiTableFlags_SizingFixedFit)) {
      for (const Gesture& gesture : gestures()) cells(gesture.label, gesture.effect);
      ImGui::EndTable();
    }
    ImGui::Separator();
    // Keys in two columns of label and effect each, so that the panel fits into small windows.
    if (ImGui::BeginTable("keys", 4, ImGuiTableFlags_SizingFixedFit)) {
      const auto keys = key_bindings();
      const std::size_t half = (keys.size() + 1) / 2;
      for (std::size_t row = 0; row < half; ++row) {
        cells(keys[row].label, keys[row].effect);
        if (row + half < keys.size()) cells(keys[row + half].label, keys[row + half].effect);
      }
      ImGui::EndTable();
    }
  }
  ImGui::End();
}

void Panels::hints(const globe::Globe& globe, bool& shown) {
  const auto sentences = globe.hints();
  if (sentences.empty()) return;
  anchor(0.5f, 0.0f, std::max(kBelowToolbar, activity_bottom_));
  ImGui::SetNextWindowSizeConstraints({0.0f, 0.0f}, {640.0f, 300.0f});
  ImGui::Begin("hints", nullptr, kOverlay);
  for (const std::string& sentence : sentences) {
    ImGui::PushTextWrapPos(600.0f);
    ImGui::TextColored({1.0f, 0.80f, 0.40f, 1.0f}, "%s", sentence.c_str());
    ImGui::PopTextWrapPos();
  }
  if (ImGui::Button("Dismiss")) shown = false;
  ImGui::End();
}

void Panels::activity(const Moment& moment) {
  activity_bottom_ = 0.0f;
  if (!moment.recording && !moment.replaying && moment.notice.empty()) return;
  const float wrap = 0.8f * ImGui::GetIO().DisplaySize.x;
  const bool is_one_line = ImGui::CalcTextSize(moment.notice.c_str(), nullptr, false, wrap).y < 1.5f * ImGui::GetTextLineHeight();
  anchor(1.0f, 0.0f, is_one_line ? 0.0f : kBelowToolbar);
  ImGui::Begin("activity", nullptr, kOverlay | ImGuiWindowFlags_NoInputs);
  if (moment.recording) ImGui::TextColored({1.0f, 0.35f, 0.30f, 1.0f}, "recording (K stops)");
  if (moment.replaying) ImGui::TextColored(kAccent, "replaying (J stops)");
  ImGui::PushTextWrapPos(wrap);
  if (!moment.notice.empty()) ImGui::TextUnformatted(moment.notice.c_str());
  ImGui::PopTextWrapPos();
  activity_bottom_ = ImGui::GetWindowPos().y + ImGui::GetWindowHeight();
  ImGui::End();
}

void Panels::status_line(const globe::Globe& globe, const globe::FrameStats& stats, const Moment& moment) {
  const ImVec2 padding{10.0f, 5.0f};
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, padding);
  const std::string status = status_text(stats, moment);
  anchor(0.0f, 1.0f);
  ImGui::Begin("status", nullptr, kOverlay | ImGuiWindowFlags_NoInputs);
  ImGui::TextUnformatted(status.c_str());
  ImGui::End();

  // Beside the status line, or above it where both do not fit.
  const std::vector<std::string> credits = attributions(globe);
  const float width = ImGui::GetIO().DisplaySize.x, wrap = 0.6f * width;
  float widest = 0.0f;
  for (const std::string& line : credits) widest = std::max(widest, std::min(ImGui::CalcTextSize(line.c_str()).x, wrap));
  const bool fits = ImGui::CalcTextSize(status.c_str()).x + widest + 4 * padding.x + 3 * kMargin <= width;
  anchor(1.0f, 1.0f, fits ? 0.0f : -(ImGui::GetTextLineHeight() + 2 * padding.y + kMargin / 2));
  ImGui::Begin("attribution", nullptr, kOverlay | ImGuiWindowFlags_NoInputs);
  ImGui::PushTextWrapPos(wrap);
  ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
  for (const std::string& line : credits) ImGui::TextUnformatted(line.c_str());
  ImGui::PopStyleColor();
  ImGui::PopTextWrapPos();
  ImGui::End();
  ImGui::PopStyleVar();
}

}  // namespace tellurion::apps
