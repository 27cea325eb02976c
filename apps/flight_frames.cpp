#include "flight_frames.h"

#include <chrono>
#include <cmath>

#include <CLI/CLI.hpp>

namespace tellurion::apps {

void add_flight_options(CLI::App& app, FlightOptions& options) {
  app.add_option("--fps", options.frames_per_second, "frames a second (30)")->check(in_range(0.001, 1000.0))->type_name("N");
  app.add_option("--clock-rate", options.clock_rate, "how fast the world's time runs (1)")->check(in_range(-1e9, 1e9))->type_name("R");
  app.add_option("--timeout", options.timeout_seconds, "for each frame to load (120)")->check(in_range(0.0, 1e6))->type_name("S");
}

int frame_count(const view::Flight& flight, const FlightOptions& options) {
  return static_cast<int>(std::floor((flight.end_s() - flight.start_s()) * options.frames_per_second + 1e-9)) + 1;
}

double frame_seconds(int frame, const FlightOptions& options) { return frame / options.frames_per_second; }

view::Camera frame_camera(const view::Flight& flight, int frame, const FlightOptions& options, const geo::Ellipsoid& ellipsoid) {
  return view::make_camera(ellipsoid, flight.pose_at(flight.start_s() + frame_seconds(frame, options)),
                           to_radians(Degrees(options.vertical_fov_degrees)), options.width, options.height);
}

globe::ViewSettings frame_settings(int frame, const FlightOptions& options) {
  globe::ViewSettings settings = options.view;
  if (settings.time) {
    *settings.time += std::chrono::duration_cast<std::chrono::milliseconds>(
        std::chrono::duration<double>(frame_seconds(frame, options) * options.clock_rate));
  }
  return settings;
}

}  // namespace tellurion::apps
