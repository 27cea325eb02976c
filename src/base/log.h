// Messages for the person who runs the program: one line each, on standard error.
// Thread-safe: lines never mix. The process has one standard error, hence free functions.
#pragma once

#include <string_view>

namespace tellurion::log {

enum class Severity { debug, info, warning, error };

/// Drops what is less severe. At the start: info.
void set_threshold(Severity least);

/// Writes `severity: message`; an info line is the bare message.
void write(Severity severity, std::string_view message);

inline void debug(std::string_view message) { write(Severity::debug, message); }
inline void info(std::string_view message) { write(Severity::info, message); }
inline void warning(std::string_view message) { write(Severity::warning, message); }
inline void error(std::string_view message) { write(Severity::error, message); }

}  // namespace tellurion::log
