#include "bench/output.h"

#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "gpu/render_thread.h"

namespace tellurion::bench {
namespace {

std::string processor() {
  std::ifstream stream("/proc/cpuinfo");
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with("model name")) continue;
    if (const auto colon = line.find(": "); colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown processor";
}

std::string driver() {
  const auto thread = gpu::RenderThread::headless(gpu::Api::core);
  if (!thread) return "no OpenGL: " + thread.error().message;
  const gpu::Capabilities& capabilities = (*thread)->capabilities();
  return fmt::format("{}, OpenGL {}", capabilities.renderer, capabilities.version);
}

constexpr const char* compiler() {
#ifdef __clang__
  return "clang " __clang_version__;
#else
  return "gcc " __VERSION__;
#endif
}

constexpr const char* kind_of_build() {
#ifdef __OPTIMIZE__
  return "optimised";
#else
  return "not optimised";
#endif
}

std::string number(double value) {
  return value == static_cast<double>(static_cast<std::int64_t>(value)) ? fmt::format("{:.0f}", value) : fmt::format("{:.4g}", value);
}

const char* verdict(const Figure& figure) {
  const auto met = figure.meets_goal();
  return !met ? "" : *met ? "met" : "MISSED";
}

}  // namespace

std::string machine_line() {
  return fmt::format("{}, {} cores; {}; {}, {}", processor(), std::thread::hardware_concurrency(), driver(), compiler(), kind_of_build());
}

std::string goal_text(const Measure& measure) {
  if (!measure.goal) return {};
  return fmt::format("at {} {}", measure.better == Better::lower ? "most" : "least", number(*measure.goal));
}

std::string table_line(const Figure& figure) {
  return fmt::format("{:<36} {:>10} {:<11} {:<17} {:<6}  {}", figure.measure.name, figure.value ? number(*figure.value) : "-",
                     figure.measure.unit, goal_text(figure.measure), verdict(figure), figure.note);
}

std::string to_json(std::span<const Figure> figures) {
  const auto or_null = [](const std::optional<double>& v) { return v ? nlohmann::ordered_json(*v) : nlohmann::ordered_json(nullptr); };
  nlohmann::ordered_json array = nlohmann::ordered_json::array();
  for (const Figure& figure : figures) {
    array.push_back({{"name", figure.measure.name},
                     {"value", or_null(figure.value)},
                     {"unit", figure.measure.unit},
                     {"goal", or_null(figure.measure.goal)},
                     {"note", figure.conditions + (figure.note.empty() ? "" : "; " + figure.note)},
                     {"better", figure.measure.better == Better::lower ? "lower" : "higher"}});
  }
  return array.dump(2) + "\n";
}

}  // namespace tellurion::bench
