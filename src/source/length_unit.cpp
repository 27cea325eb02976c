#include "source/length_unit.h"

#include <algorithm>
#include <array>

namespace tellurion::source {
namespace {

constexpr double kFoot = 0.3048;
constexpr double kUsSurveyFoot = 1200.0 / 3937.0;

struct Unit {
  std::string_view name;
  double metres;
};

// In words, as GDAL shortens them, and by the Unified Code for Units of Measure.
constexpr std::array<Unit, 18> kUnits{{{"m", 1.0}, {"metre", 1.0}, {"meter", 1.0}, {"metres", 1.0}, {"meters", 1.0}, {"km", 1000.0}, {"dm", 0.1}, {"cm", 0.01}, {"mm", 0.001},
                                       {"ft", kFoot}, {"foot", kFoot}, {"feet", kFoot}, {"[ft_i]", kFoot},
                                       {"us-ft", kUsSurveyFoot}, {"ftUS", kUsSurveyFoot}, {"US survey foot", kUsSurveyFoot}, {"US survey feet", kUsSurveyFoot}, {"[ft_us]", kUsSurveyFoot}}};

constexpr char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace

std::optional<double> metres_of_unit(std::string_view name) {
  const auto same = [&](const Unit& unit) {
    return std::equal(name.begin(), name.end(), unit.name.begin(), unit.name.end(), [](char a, char b) { return lower(a) == lower(b); });
  };
  const auto found = std::find_if(kUnits.begin(), kUnits.end(), same);
  return found == kUnits.end() ? std::nullopt : std::optional(found->metres);
}

}  // namespace tellurion::source
