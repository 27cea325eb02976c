// A flight as frames: how many, from where each is seen, and at which time of the world.
#pragma once

#include "options.h"

namespace tellurion::apps {

struct FlightOptions : Options {
  std::filesystem::path flight;
  double frames_per_second = 30.0;
  double clock_rate = 1.0;
};

/// --fps, --clock-rate and --timeout.
void add_flight_options(CLI::App& app, FlightOptions& options);

int frame_count(const view::Flight& flight, const FlightOptions& options);
/// Seconds since the flight's start.
double frame_seconds(int frame, const FlightOptions& options);
view::Camera frame_camera(const view::Flight& flight, int frame, const FlightOptions& options, const geo::Ellipsoid& ellipsoid);
globe::ViewSettings frame_settings(int frame, const FlightOptions& options);

}  // namespace tellurion::apps
