// A globe and a view of it over the middle of Europe, for tests of what changes while it is shown.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include <doctest/doctest.h>

#include "globe/globe.h"
#include "globe/globe_view.h"

namespace tellurion::globe::test {

inline constexpr std::chrono::seconds kPatience{60};

struct Show {
  Show(gpu::RenderThread& thread, const World& world, int workers, const std::filesystem::path& cache_folder = {}) {
    GlobeOptions options;
    options.workers = workers;
    options.cache_folder = cache_folder;
    auto opened = Globe::open(world, options);
    REQUIRE(opened.has_value());
    globe = std::move(*opened);
    auto made = GlobeView::create(*globe, thread, std::size_t{64} << 20);
    REQUIRE(made.has_value());
    view = std::move(*made);
    view::Pose pose;
    pose.position = {to_radians(Degrees(41.0)), to_radians(Degrees(20.3)), EllipsoidalHeight(300e3)};
    pose.pitch = to_radians(Degrees(-50.0));
    camera = view::make_camera(globe->ellipsoid(), pose, to_radians(Degrees(45.0)), 320, 200);
  }

  std::vector<std::uint8_t> finished_picture() {
    REQUIRE(view->finish(camera, {}, std::chrono::steady_clock::now() + kPatience));
    return view->picture(camera, {}).rgba;
  }
  /// Frames that wait for nothing, until one shows all.
  std::vector<std::uint8_t> picture_after_frames() {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    do {
      REQUIRE(std::chrono::steady_clock::now() < deadline);
      (void)view->update(camera, {}, 5.0);
    } while (!view->stats().complete);
    return view->picture(camera, {}).rgba;
  }

  std::unique_ptr<Globe> globe;
  std::unique_ptr<GlobeView> view;
  view::Camera camera;
};

}  // namespace tellurion::globe::test
