#include "viewer/viewer.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace tellurion::apps {
namespace {

constexpr int kSettlingFrames = 3;    // drawn after whatever the user does
constexpr double kFadeSeconds = 0.5;  // longer than a change of level takes
constexpr double kLongestStep = 0.1;  // seconds: after a rest or a stall, motion does not leap
constexpr double kRestSeconds = 0.5;
constexpr double kLoadingRestSeconds = 0.01;
constexpr double kLookBelowSeconds = 0.2;
constexpr double kNoticeSeconds = 4.0;
constexpr double kErrorSeconds = 12.0;
constexpr std::size_t kMostErrors = 6;
constexpr double kExaggerationStep = 1.189207115002721;  // four steps double
constexpr double kSunStepSeconds = 24.0;                 // in which the sun moves by a tenth of a degree

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(std::llround(seconds * 1e3));
}

}  // namespace

Viewer::Viewer(const ViewerOptions& options, Window window, FlightRecorder recorder)
    : options_(options), window_(std::move(window)), input_(window_), panels_(window_), recorder_(std::move(recorder)) {
  state_.view = options.view;
  state_.view.transitions = true;
  state_.clock.time = options.view.time;
}

Result<std::unique_ptr<Viewer>> Viewer::open(const ViewerOptions& options) {
  auto window = Window::open("Tellurion", {options.width, options.height}, options.api);
  if (!window) return window.error();
  auto recorder = FlightRecorder::open(options.flight_file);
  if (!recorder) return recorder.error();
  std::unique_ptr<Viewer> viewer(new Viewer(options, std::move(*window), std::move(*recorder)));
  if (const auto opened = viewer->open_world(); !opened) return opened.error();
  if (const auto opened = viewer->open_logs(); !opened) return opened.error();
  viewer->window_.show();
  return viewer;
}

Result<void> Viewer::open_world() {
  auto thread = gpu::RenderThread::adopt_current();
  if (!thread) return thread.error();
  thread_ = std::move(*thread);
  auto globe = open_globe(options_);
  if (!globe) return globe.error();
  globe_ = std::move(*globe);
  auto view = globe::GlobeView::create(*globe_, *thread_, options_.gpu_cache_bytes);
  if (!view) return view.error();
  view_ = std::move(*view);
  const auto camera =
      view::make_camera(globe_->ellipsoid(), camera_or_home(options_, *globe_, std::chrono::seconds(1)),
                        to_radians(Degrees(options_.vertical_fov_degrees)), options_.width, options_.height);
  navigation_.emplace(globe_->ellipsoid(), camera, [this](const view::Camera& from, glm::dvec2 pixel) {
    return view_->pick(from, pixel, state_.view);
  });
  return {};
}

Result<void> Viewer::open_logs() {
  const auto open = [](std::ofstream& stream, const std::filesystem::path& file,
                       const std::string& header) -> Result<void> {
    if (file.empty()) return {};
    stream.open(file, std::ios::binary);
    if (!(stream << header))
      return {ErrorCode::unavailable,
              fmt::format("{}: cannot be written; is the folder there and writable?", file.string())};
    return {};
  };
  if (const auto opened = open(trace_, options_.trace_file, globe::trace_header()); !opened) return opened;
  return open(camera_log_, options_.camera_log, view::format_flight({}));
}

Viewer::~Viewer() { done_->close(); }

void Viewer::run() {
  double last = seconds_now();
  while (!window_.should_close()) {
    input_.wait(resting_seconds(last));
    const double now = seconds_now();
    advance_clock(now - last);
    if (input_.take_activity()) frames_owed_ = kSettlingFrames;
    take_done(now);
    if (picture_changes(now)) frame(now, std::min(now - last, kLongestStep));
    else if (shown_complete_ && now >= draw_until_) view_->prepare_switches(state_.view);
    recorder_.note(now, view::pose_of(globe_->ellipsoid(), navigation_->camera()));
    last = now;
  }
  if (recorder_.recording()) toggle_recording(last);
}

// --- When to draw
// ------------------------------------------------------------------------------------------------------

bool Viewer::moves_by_itself() const { return frames_owed_ > 0 || navigation_->moving() || recorder_.replaying(); }

bool Viewer::picture_changes(double now) {
  if (moves_by_itself()) return true;
  if (now - last_look_below_ > kLookBelowSeconds && look_below(now)) return true;
  if (!notice_.empty() && now >= notice_until_) return true;
  // As much time as a frame takes is left to the workers: without a GPU they share the processor with it.
  if (now - last_frame_ended_ < view_->stats().frame_ms * 1e-3) return false;
  if (now < draw_until_) return true;
  if (state_.clock.running && now - last_frame_ended_ >= std::min(kSunStepSeconds / state_.clock.rate, 1.0))
    return true;
  if (shown_complete_) return false;
  const globe::FrameStats& stats = view_->update(navigation_->camera(), state_.view);
  return stats.complete || stats.bytes_uploaded != shown_bytes_;
}

double Viewer::resting_seconds(double now) const {
  if (moves_by_itself()) return 0.0;
  if (!shown_complete_ || now < draw_until_) return kLoadingRestSeconds;
  double seconds = kRestSeconds;
  if (recorder_.recording()) seconds = std::min(seconds, 0.1);
  if (!notice_.empty()) seconds = std::min(seconds, std::max(notice_until_ - now, 0.01));
  if (state_.clock.running) seconds = std::clamp(kSunStepSeconds / state_.clock.rate, 0.01, seconds);
  return seconds;
}

bool Viewer::look_below(double now) {
  last_look_below_ = now;
  const view::Camera& camera = navigation_->camera();
  ground_ = view_->ground_below(camera).value_or(EllipsoidalHeight(0.0)) * state_.view.exaggeration;
  const EllipsoidalHeight eye = geo::to_geodetic(globe_->ellipsoid(), camera.eye).height;
  return eye.value < ground_.value + 0.99 * state_.motion.least_height_m;
}

void Viewer::advance_clock(double seconds) {
  if (state_.clock.time && state_.clock.running) *state_.clock.time += milliseconds(seconds * state_.clock.rate);
  state_.view.time = state_.clock.time;
}

// --- A frame
// -----------------------------------------------------------------------------------------------------------

void Viewer::frame(double now, double seconds) {
  frames_owed_ = std::max(frames_owed_ - 1, 0);
  const glm::ivec2 size = window_.size_px();
  if (size.x == 0 || size.y == 0) return;  // minimised
  navigation_->resize(size);
  panels_.begin();
  handle(input_.take_events(panels_.take_mouse(), panels_.take_keyboard()), now);
  look_below(now);
  if (const auto pose = recorder_.replayed(now)) navigation_->jump_to(*pose);
  navigation_->advance(now, seconds, input_.held_motion(panels_.take_keyboard()), ground_, state_.motion);

  const globe::FrameStats& stats = view_->draw(navigation_->camera(), state_.view);
  if (stats.bytes_uploaded != shown_bytes_) draw_until_ = now + kFadeSeconds;
  shown_bytes_ = stats.bytes_uploaded;
  shown_complete_ = stats.complete;
  const Asked asked = panels_.draw(*globe_, stats, moment(now), state_);
  window_.show_frame();
  write_logs(now);
  if (asked.command) obey(*asked.command, now);
  if (asked.fly_to) fly_to(asked.fly_to);
  if (now >= notice_until_) notice_.clear();
  last_frame_ended_ = seconds_now();
}

Moment Viewer::moment(double now) const {
  Moment moment;
  const view::Camera& camera = navigation_->camera();
  moment.pose = view::pose_of(globe_->ellipsoid(), camera);
  moment.compass = compass_of(moment.pose);
  moment.height_above_ground_m = moment.pose.position.height.value - ground_.value;
  const auto forward = camera.forward();
  const double distance = geo::intersect_ray(globe_->ellipsoid(), Metres(ground_.value), camera.eye, forward);
  if (distance > 0.0) moment.metres_per_pixel = distance * camera.pixel_angle();
  find_cursor(moment);
  moment.recording = recorder_.recording();
  moment.replaying = recorder_.replaying();
  if (now < notice_until_) moment.notice = notice_;
  return moment;
}

void Viewer::find_cursor(Moment& moment) const {
  if (!input_.cursor_inside()) return;
  const glm::dvec2 cursor = input_.cursor();
  const geo::Ellipsoid& ellipsoid = globe_->ellipsoid();
  if (const auto& grip = navigation_->grip(); grip && glm::distance(grip->pixel, cursor) < 1.0) {
    const geo::Geodetic place = geo::to_geodetic(ellipsoid, grip->place);
    moment.cursor = geo::place_of(place);
    if (state_.view.exaggeration > 0.0) moment.cursor_height_m = place.height.value / state_.view.exaggeration;
    return;
  }
  // A level surface at the height of the ground under the eye stands in: asking the renderer would cost a pass.
  const view::Camera& camera = navigation_->camera();
  const auto ray = camera.ray(cursor);
  const double distance = geo::intersect_ray(ellipsoid, Metres(ground_.value), camera.eye, ray);
  if (distance > 0.0) moment.cursor = geo::place_of(geo::to_geodetic(ellipsoid, camera.eye + ray * distance));
}

void Viewer::write_logs(double now) {
  if (trace_.is_open()) {
    globe::FrameStats stats = view_->stats();
    stats.resident_bytes = globe::resident_bytes();
    trace_ << globe::trace_line(stats) << std::flush;
  }
  if (camera_log_.is_open()) {
    const view::FlightSample sample{now, view::pose_of(globe_->ellipsoid(), navigation_->camera())};
    const std::string text = view::format_flight({&sample, 1});
    camera_log_ << text.substr(text.find('\n') + 1) << std::flush;
  }
}

// --- What the user asks for
// --------------------------------------------------------------------------------------------

void Viewer::handle(const std::vector<Event>& events, double now) {
  for (const Event& event : events) {
    const bool moves_camera = !std::holds_alternative<Command>(event) && !std::holds_alternative<CursorMove>(event) && !std::holds_alternative<Drop>(event);
    if (moves_camera) recorder_.stop_replay();
    if (const auto* start = std::get_if<DragStart>(&event))
      navigation_->start_drag(*start, now);
    else if (const auto* move = std::get_if<CursorMove>(&event))
      navigation_->move_cursor(*move, now);
    else if (std::holds_alternative<DragEnd>(event))
      navigation_->end_drag(now);
    else if (const auto* wheel = std::get_if<Wheel>(&event))
      navigation_->wheel(*wheel, state_.motion);
    else if (const auto* click = std::get_if<DoubleClick>(&event))
      navigation_->approach(click->at, now);
    else if (const auto* drop = std::get_if<Drop>(&event))
      add(*drop);
    else
      obey(std::get<Command>(event), now);
  }
}

void Viewer::obey(Command command, double now) {
  const auto flip = [](bool& on) { on = !on; };
  const auto zoom_at_middle = [this](double steps) {
    const view::Camera& camera = navigation_->camera();
    navigation_->wheel({steps, 0.5 * glm::dvec2(camera.width, camera.height)}, state_.motion);
  };
  const auto exaggerate = [this](double factor) {
    const double wanted = std::clamp(state_.view.exaggeration * factor, 0.1, 100.0);
    state_.view.exaggeration = std::abs(wanted - 1.0) < 1e-3 ? 1.0 : wanted;
    say(fmt::format("exaggeration {:.2f}", state_.view.exaggeration));
  };
  globe::ViewSettings& view = state_.view;
  PanelsShown& shown = state_.shown;
  switch (command) {
    case Command::zoom_in:
      zoom_at_middle(1.0);
      break;
    case Command::zoom_out:
      zoom_at_middle(-1.0);
      break;
    case Command::north_up:
      navigation_->turn_north_up();
      break;
    case Command::reset_tilt:
      navigation_->reset_tilt();
      break;
    case Command::home:
      fly_to(std::nullopt);
      break;
    case Command::freeze:
      flip(view.frozen);
      say(view.frozen ? "tiles frozen" : "tiles follow the camera");
      break;
    case Command::help:
      flip(shown.help);
      break;
    case Command::statistics:
      flip(shown.statistics);
      break;
    case Command::layers:
      flip(shown.layers);
      break;
    case Command::settings:
      flip(shown.settings);
      break;
    case Command::save_layers:
      save_layers();
      break;
    case Command::wireframe:
      flip(view.wireframe);
      break;
    case Command::bounds:
      flip(view.bounds);
      break;
    case Command::tile_borders:
      flip(view.tile_borders);
      break;
    case Command::lighting:
      flip(view.lighting);
      break;
    case Command::atmosphere:
      flip(view.atmosphere);
      break;
    case Command::exaggerate_less:
      exaggerate(1.0 / kExaggerationStep);
      break;
    case Command::exaggerate_more:
      exaggerate(kExaggerationStep);
      break;
    case Command::clock:
      if (!state_.clock.time)
        state_.clock.time = std::chrono::floor<std::chrono::milliseconds>(std::chrono::system_clock::now());
      flip(state_.clock.running);
      say(state_.clock.running ? "the clock runs" : "the clock stands still");
      break;
    case Command::screenshot:
      save_screenshot();
      break;
    case Command::record:
      toggle_recording(now);
      break;
    case Command::replay:
      toggle_replay(now);
      break;
    case Command::quit:
      window_.close();
      break;
  }
  frames_owed_ = std::max(frames_owed_, kSettlingFrames);
}

void Viewer::toggle_recording(double now) {
  if (!recorder_.recording()) return recorder_.start_recording(now);
  const auto written = recorder_.stop_recording();
  say(written ? fmt::format("flight written: {}", recorder_.file().string()) : written.error().message);
  if (!written) report(written.error());
}

void Viewer::toggle_replay(double now) {
  if (recorder_.replaying()) return recorder_.stop_replay();
  if (recorder_.recording()) toggle_recording(now);
  if (const auto started = recorder_.start_replay(now); !started) say(started.error().message);
}

void Viewer::save_screenshot() {
  std::filesystem::path file;
  std::error_code ignored;
  do {
    file = fmt::format("tellurion-{:03}.png", ++last_screenshot_);
  } while (std::filesystem::exists(file, ignored));
  const auto written = globe::write_png(file, view_->picture(navigation_->camera(), state_.view));
  say(written ? fmt::format("saved {}", file.string()) : written.error().message);
  if (!written) report(written.error());
}

void Viewer::say(const std::string& text) { say(text, kNoticeSeconds); }

void Viewer::say(const std::string& text, double seconds) {
  notice_ = text;
  notice_until_ = seconds_now() + seconds;
}

// --- What workers do for the user ------------------------------------------------------------------------------------

void Viewer::add(const Drop& drop) {
  globe_->add_data(drop.paths, [done = done_, globe = globe_.get()](const std::vector<globe::AddedData>& added) {
    Done what;
    for (const globe::AddedData& one : added) {
      if (one.layer) what.news = fmt::format("added {}", what.news.empty() ? globe->layer(*one.layer).spec.name : "layers");
      else what.errors.push_back(one.layer.error());
    }
    done->push(std::move(what));
    Window::wake();
  });
  shown_complete_ = false;
  say(drop.paths.size() == 1 ? fmt::format("opening {}", drop.paths.front()) : fmt::format("opening {} files", drop.paths.size()), kErrorSeconds);
}

void Viewer::fly_to(std::optional<std::size_t> layer) {
  recorder_.stop_replay();
  have_done([globe = globe_.get(), layer] { return Done{{}, {}, layer ? globe->home(*layer) : globe->home()}; });
}

void Viewer::save_layers() {
  have_done([globe = globe_.get()]() -> Done {
    const auto file = globe::save_layers(*globe, {});
    if (!file) return {{}, {file.error()}};
    return {fmt::format("layers saved in {}", file->string()), {}};
  });
}

void Viewer::have_done(std::function<Done()> work) {
  const bool submitted = globe_->try_submit([done = done_, work = std::move(work)](globe::SurfaceWorker&) {
    done->push(work());
    Window::wake();
  });
  shown_complete_ = false;  // without threads, looking for what there is to draw runs it
  if (!submitted) say("too much is being loaded: once more, please");
}

void Viewer::take_done(double now) {
  while (auto done = done_->try_pop()) {
    frames_owed_ = std::max(frames_owed_, kSettlingFrames);
    shown_complete_ = false;
    if (done->fly_to) navigation_->fly_to(*done->fly_to, now);
    std::string text = done->news;
    for (std::size_t i = 0; i < done->errors.size(); ++i) {
      report(done->errors[i]);
      if (i < kMostErrors) text += (text.empty() ? "" : "\n") + done->errors[i].message;
      if (i == kMostErrors) text += fmt::format("\nand {} more cannot be shown", done->errors.size() - i);
    }
    if (!text.empty()) say(text, done->errors.empty() ? kNoticeSeconds : kErrorSeconds);
  }
}

}  // namespace tellurion::apps
