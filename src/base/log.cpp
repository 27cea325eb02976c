#include "base/log.h"

#include <spdlog/logger.h>
#include <spdlog/sinks/stdout_color_sinks.h>

#include <memory>
#include <string>

namespace tellurion::log {
namespace {

spdlog::level::level_enum level_of(Severity severity) {
  switch (severity) {
    case Severity::debug:
      return spdlog::level::debug;
    case Severity::info:
      return spdlog::level::info;
    case Severity::warning:
      return spdlog::level::warn;
    case Severity::error:
      return spdlog::level::err;
  }
  return spdlog::level::err;
}

/// Not in spdlog's registry, so that a program which embeds us keeps its own loggers.
spdlog::logger& logger() {
  static spdlog::logger instance = [] {
    spdlog::logger made("tellurion", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
    made.set_level(spdlog::level::info);
    made.flush_on(spdlog::level::trace);
    made.set_pattern("%v");
    return made;
  }();
  return instance;
}

const char* prefix_of(Severity severity) {
  switch (severity) {
    case Severity::debug:
      return "debug: ";
    case Severity::info:
      return "";
    case Severity::warning:
      return "warning: ";
    case Severity::error:
      return "error: ";
  }
  return "";
}

}  // namespace

void set_threshold(Severity least) { logger().set_level(level_of(least)); }

void write(Severity severity, std::string_view message) {
  if (!logger().should_log(level_of(severity))) return;
  logger().log(level_of(severity), std::string(prefix_of(severity)).append(message));
}

}  // namespace tellurion::log
