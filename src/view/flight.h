// Recorded camera flights: read, written and interpolated.
// Thread-safe: a Flight does not change once it is made.
// Format: CSV with the header `time,lat,lon,height,heading,pitch,roll`; seconds, degrees, metres above the ellipsoid.
#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "view/camera.h"

namespace tellurion::view {

/// Times of samples lie at least so far apart: what the text form resolves.
inline constexpr double kShortestStep_s = 1e-6;

struct FlightSample {
  double time_s = 0;
  Pose pose;
};

/// A smooth way through samples: continuous in position, direction and their first derivatives.
/// Between two samples the height stays between theirs; where the camera rests, it rests.
class Flight {
 public:
  /// Errors: invalid_argument (no samples, times not growing by 1e-6 s, or neighbours nearly on opposite sides of the
  /// planet).
  static Result<Flight> create(std::vector<FlightSample> samples);

  std::span<const FlightSample> samples() const { return samples_; }
  double start_s() const { return samples_.front().time_s; }
  double end_s() const { return samples_.back().time_s; }

  /// The pose at a time; before the start and after the end the first and the last one.
  Pose pose_at(double time_s) const;

 private:
  Flight() = default;

  /// A sample in coordinates without poles or jumps, with the rates at which they change.
  struct Knot {
    glm::dvec3 normal{0.0}, normal_rate{0.0};
    /// Quaternion (x, y, z, w) of the camera axes in ECEF, of the two the one nearer to the neighbour's.
    glm::dvec4 turn{0.0}, turn_rate{0.0};
    double height = 0, height_rate = 0;
  };

  std::vector<FlightSample> samples_;
  std::vector<Knot> knots_;
};

/// Reads a flight out of the text of a CSV file; `name` appears in errors. Blank lines are skipped.
/// Errors: corrupt, naming file, line and column.
Result<Flight> parse_flight(std::string_view text, std::string_view name);
/// Errors as parse_flight, and not_found or unavailable for the file.
Result<Flight> read_flight(const std::filesystem::path& path);

/// The CSV text of samples, exact enough to read the same numbers back (1e-9 degrees, 1e-6 m and s).
std::string format_flight(std::span<const FlightSample> samples);
/// Errors: unavailable, naming the file.
Result<void> write_flight(const std::filesystem::path& path, std::span<const FlightSample> samples);

}  // namespace tellurion::view
