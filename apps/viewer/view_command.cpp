// tellurion view: the window.
#include <CLI/CLI.hpp>
#include <memory>

#include "commands.h"
#include "options.h"
#include "viewer/viewer.h"

namespace tellurion::apps {
namespace {

int view(const ViewerOptions& options) {
  auto viewer = Viewer::open(options);
  if (!viewer) return report(viewer.error());
  (*viewer)->run();
  return kDone;
}

}  // namespace

void add_view(CLI::App& app, Run& run) {
  auto options = std::make_shared<ViewerOptions>();
  CLI::App* command = app.add_subcommand("view", "the window");
  add_world(*command, *options, false);
  add_camera(*command, *options);
  add_view_options(*command, *options);
  add_resource_options(*command, *options);
  command
      ->add_option("--flight", options->flight_file,
                   "the flight that J replays and K records into (tellurion-flight.csv)")
      ->type_name("FILE.csv");
  command->add_option("--trace", options->trace_file, "write the figures of every frame")->type_name("FILE.csv");
  command->add_option("--camera-log", options->camera_log, "write where the camera is at every frame, as a flight")
      ->type_name("FILE.csv");
  command->callback([options, &run] { run = [options] { return view(*options); }; });
}

}  // namespace tellurion::apps
