#include "viewer/panel_kit.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

namespace tellurion::apps {

std::string text_of_bytes(double bytes) {
  if (bytes < 1e3) return fmt::format("{:.0f} B", bytes);
  if (bytes < 1e6) return fmt::format("{:.1f} kB", bytes / 1e3);
  if (bytes < 1e9) return fmt::format("{:.1f} MB", bytes / 1e6);
  return fmt::format("{:.2f} GB", bytes / 1e9);
}

std::string text_of_metres(double metres) {
  const double size = std::abs(metres);
  if (size < 10.0) return fmt::format("{:.1f} m", metres);
  if (size < 2e3) return fmt::format("{:.0f} m", metres);
  if (size < 1e5) return fmt::format("{:.1f} km", metres / 1e3);
  return fmt::format("{:.0f} km", metres / 1e3);
}

std::string text_of_place(const geo::LatLon& place) {
  const double latitude = to_degrees(place.latitude).value;
  const double longitude = std::remainder(to_degrees(place.longitude).value, 360.0);
  return fmt::format("{:.4f}\xC2\xB0 {}  {:.4f}\xC2\xB0 {}", std::abs(latitude), latitude < 0 ? 'S' : 'N',
                     std::abs(longitude), longitude < 0 ? 'W' : 'E');
}

double Rate::of(double figure, std::chrono::steady_clock::time_point now) {
  while (!looks_.empty() && now - looks_.front().when > std::chrono::seconds(2)) looks_.pop_front();
  if (looks_.empty() || now - looks_.back().when >= std::chrono::milliseconds(50)) looks_.push_back({now, figure});
  const double seconds = std::chrono::duration<double>(now - looks_.front().when).count();
  return seconds > 0.0 ? (figure - looks_.front().figure) / seconds : 0.0;
}

void table_row(const char* name, const std::string& value) {
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  ImGui::TextDisabled("%s", name);
  ImGui::TableNextColumn();
  const float room = ImGui::GetContentRegionAvail().x - ImGui::CalcTextSize(value.c_str()).x;
  ImGui::SetCursorPosX(ImGui::GetCursorPosX() + std::max(room, 0.0f));
  ImGui::TextUnformatted(value.c_str());
}

}  // namespace tellurion::apps
