#include "viewer/flight_recorder.h"

namespace tellurion::apps {
namespace {

constexpr double kSampleSeconds = 0.1;
constexpr double kPauseSeconds = 1.0;  // between what was recorded before and what is appended

}  // namespace

Result<FlightRecorder> FlightRecorder::open(std::filesystem::path file) {
  FlightRecorder recorder(std::move(file));
  std::error_code ignored;
  if (std::filesystem::exists(recorder.file_, ignored)) {
    const auto flight = view::read_flight(recorder.file_);
    if (!flight) return flight.error();
    recorder.samples_.assign(flight->samples().begin(), flight->samples().end());
  }
  return recorder;
}

void FlightRecorder::start_recording(double now) {
  stop_replay();
  const double start = samples_.empty() ? 0.0 : samples_.back().time_s + kPauseSeconds;
  recording_since_ = now - start;
}

Result<void> FlightRecorder::stop_recording() {
  recording_since_.reset();
  return view::write_flight(file_, samples_);
}

void FlightRecorder::note(double now, const view::Pose& pose) {
  if (!recording_since_) return;
  const double time = now - *recording_since_;
  if (samples_.empty() || time - samples_.back().time_s >= kSampleSeconds) samples_.push_back({time, pose});
}

Result<void> FlightRecorder::start_replay(double now) {
  if (samples_.empty()) return {ErrorCode::invalid_argument, "there is no flight to replay yet: K records one"};
  auto flight = view::Flight::create(samples_);
  if (!flight) return flight.error();
  replay_ = Replay{std::move(*flight), now};
  return {};
}

std::optional<view::Pose> FlightRecorder::replayed(double now) {
  if (!replay_) return std::nullopt;
  const double time = replay_->flight.start_s() + now - replay_->started_at;
  const view::Pose pose = replay_->flight.pose_at(time);
  if (time >= replay_->flight.end_s()) stop_replay();
  return pose;
}

}  // namespace tellurion::apps
