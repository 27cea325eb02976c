// tellurion height: "lat lon" a line in, "lat lon height level" a line out.
#include "commands.h"

#include <iostream>
#include <chrono>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "options.h"

namespace tellurion::apps {
namespace {

/// Two numbers separated by blanks, a comma or both; the words are kept as written.
bool parse_place(const std::string& line, std::string words[2], geo::LatLon& place) {
  constexpr const char* kSeparators = " \t,\r";
  std::size_t at = 0;
  double degrees[2] = {};
  for (int i = 0; i < 2; ++i) {
    const std::size_t first = line.find_first_not_of(kSeparators, at);
    if (first == std::string::npos) return false;
    at = std::min(line.find_first_of(kSeparators, first), line.size());
    words[i] = line.substr(first, at - first);
    if (!CLI::detail::lexical_cast(words[i], degrees[i])) return false;
  }
  if (line.find_first_not_of(kSeparators, at) != std::string::npos) return false;
  if (!(degrees[0] >= -90.0 && degrees[0] <= 90.0 && degrees[1] >= -540.0 && degrees[1] <= 540.0)) return false;
  place = {to_radians(Degrees(degrees[0])), to_radians(Degrees(degrees[1]))};
  return true;
}

int heights(const Options& options, globe::HeightLookup lookup, double spacing) {
  auto globe = open_globe(options);
  if (!globe) return report(globe.error());
  (void)(*globe)->wait_for_catalogues(std::chrono::steady_clock::time_point::max());
  auto sampler = (*globe)->height_sampler();
  if (!sampler) return report(sampler.error());
  int status = (*globe)->data_missing() ? kDataMissing : kDone;
  std::string line;
  for (std::int64_t number = 1; std::getline(std::cin, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    std::string words[2];
    geo::LatLon place;
    if (!parse_place(line, words, place)) {
      fmt::print(stderr, "tellurion: line {}: \"{}\" is not \"lat lon\" in degrees\n", number, line.substr(0, 60));
      status = kFailed;
      continue;
    }
    const auto answer = sampler->height_at(place, lookup, Metres(spacing));
    if (!answer) {
      fmt::print(stderr, "tellurion: line {}: {}\n", number, answer.error().message);
      if (status == kDone) status = kDataMissing;
      continue;
    }
    fmt::print("{} {} {:.4f} {:.3f}\n", words[0], words[1], answer->height.value, answer->level);
  }
  return status;
}

}  // namespace

void add_height(CLI::App& app, Run& run) {
  auto options = std::make_shared<Options>();
  auto nearest = std::make_shared<bool>(false);
  auto spacing = std::make_shared<double>(0.0);
  CLI::App* command = app.add_subcommand("height", "heights of places: \"lat lon\" a line in, \"lat lon height level\" out, metres");
  add_world(*command, *options, false);
  command->add_flag("--nearest", *nearest, "the nearest sample instead of bilinear");
  command->add_option("--spacing", *spacing, "answer from samples about this far apart (default: the finest)")->check(in_range(0.0, 1e8))->type_name("M");
  add_resource_options(*command, *options);
  command->callback([=, &run] {
    run = [=] { return heights(*options, *nearest ? globe::HeightLookup::nearest : globe::HeightLookup::bilinear, *spacing); };
  });
}

}  // namespace tellurion::apps
