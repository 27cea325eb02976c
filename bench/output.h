// Figures as text and as JSON.
#pragma once

#include <span>
#include <string>

#include "bench/registry.h"

namespace tellurion::bench {

/// What the figures were measured on: processor, cores, OpenGL driver, compiler.
std::string machine_line();

/// One line: name, value, unit, goal, whether it is met, note.
std::string table_line(const Figure& figure);

/// "at most 40", "at least 2e+06"; empty without a goal.
std::string goal_text(const Measure& measure);

/// An array of {name, value, unit, goal, note}; value and goal may be null. `better` says which way the goal lies.
std::string to_json(std::span<const Figure> figures);

}  // namespace tellurion::bench
