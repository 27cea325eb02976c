// Small parts that several panels are made of.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <memory>
#include <string>

#include "globe/api.h"

namespace tellurion::apps {

/// `bytes` for people: "12.3 MB".
std::string text_of_bytes(double bytes);
/// A length in metres for people: "850 m", "12.4 km".
std::string text_of_metres(double metres);
/// "46.5000 N  8.0000 E".
std::string text_of_place(const geo::LatLon& place);

/// How fast a figure grows, over the last two seconds. For figures that are looked at now and then.
class Rate {
 public:
  /// Takes the figure as it is now; gives its growth a second.
  double of(double figure, std::chrono::steady_clock::time_point now);

 private:
  struct Look {
    std::chrono::steady_clock::time_point when;
    double figure;
  };
  std::deque<Look> looks_;  ///< at most a few dozen: no more than one in 50 ms is kept
};

/// A row of a table of two columns: a name and, right-aligned, a value.
void table_row(const char* name, const std::string& value);

}  // namespace tellurion::apps
