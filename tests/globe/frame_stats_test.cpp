#include "globe/frame_stats.h"

#include <algorithm>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

using namespace tellurion::globe;

// The names are a contract: other programs read them.
TEST_CASE("trace_header: has the contract's names in its order") {
  CHECK(trace_header() ==
        "frame,time,frame_ms,select_ms,upload_ms,draw_ms,tiles_visited,tiles_selected,tiles_selected_by_level,tiles_drawn,"
        "tiles_drawn_by_level,tiles_waiting,triangles,draws,requests,requests_cancelled,bytes_fetched,bytes_uploaded,"
        "memory_cache_bytes,gpu_cache_bytes,disk_cache_bytes,resident_bytes,max_error_px,frames_over_budget,complete\n");
}

TEST_CASE("trace_line: has a cell for every name, levels joined by semicolons") {
  FrameStats stats;
  stats.frame = 7;
  stats.tiles_selected_by_level = {0, 2, 5};
  stats.complete = true;
  const std::string line = trace_line(stats), header = trace_header();
  CHECK(std::count(line.begin(), line.end(), ',') == std::count(header.begin(), header.end(), ','));
  CHECK(line.find("0;2;5") != std::string::npos);
  CHECK(line.substr(0, 2) == "7,");
  CHECK(line.substr(line.size() - 3) == ",1\n");
}

TEST_CASE("to_json: medians of the frames, sources with whatever bytes their errors hold") {
  SummaryStats stats;
  stats.frame_ms = {5, 1, 3, 2, 100};
  stats.sources.push_back({"a", 1, 2, 3, "not \xff utf-8"});
  const auto json = nlohmann::json::parse(to_json(stats));
  CHECK(json["frame_ms_median"] == 3);
  CHECK(json["frame_ms_max"] == 100);
  CHECK(json["sources"][0]["errors"] == 3);
}

TEST_CASE("resident_bytes: a running program takes between 1 MB and 100 GB") {
  CHECK(resident_bytes() > 1'000'000);
  CHECK(resident_bytes() < 100'000'000'000);
}
