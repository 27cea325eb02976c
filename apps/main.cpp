// The program `tellurion`: reads the command line and runs one subcommand.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "commands.h"
#include "options.h"

namespace tellurion::apps {
namespace {

int run_program(int argc, char** argv) {
  CLI::App app("Tellurion shows a planet from space to the ground.", "tellurion");
  app.set_version_flag("--version", std::string("tellurion ") + TELLURION_VERSION);
  app.require_subcommand(1);
  app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  Run run;
  add_view(app, run);
  add_render(app, run);
  add_fly(app, run);
  add_height(app, run);
  add_info(app, run);
  add_ingest(app, run);
  add_world_files(app, run);
  add_cache(app, run);
  add_bench(app, run);
  const std::string first = argc > 1 ? argv[1] : "";
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  const bool is_command = std::any_of(commands.begin(), commands.end(), [&](const CLI::App* command) { return command->get_name() == first; });
  if (!first.empty() && first.front() != '-' && !is_command) {
    fmt::print(stderr, "tellurion: \"{}\" is no command; there are view, render, fly, height, info, ingest, world, cache and bench; see tellurion --help\n", first);
    return kWrongUsage;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool asked = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success);
    if (asked) return app.exit(error) == 0 ? kDone : kWrongUsage;
    fmt::print(stderr, "tellurion: {}; see tellurion {}--help\n", error.what(), is_command ? first + " " : "");
    return kWrongUsage;
  }
  return run();
}

}  // namespace
}  // namespace tellurion::apps

int main(int argc, char** argv) {
  try {
    return tellurion::apps::run_program(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "tellurion: {}\n", error.what());
    return tellurion::apps::kFailed;
  }
}
