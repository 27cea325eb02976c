// Allocations of a steady selection, counted for the whole test program; its time is printed, and bounded generously
// because tests run on busy machines.
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <new>

#include <doctest/doctest.h>

#include "surface/selection_world.h"

using namespace tellurion;
using namespace tellurion::surface;
using namespace tellurion::surface::testing;

namespace {

std::atomic<std::size_t> allocations{0};

}  // namespace

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  std::abort();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

TEST_CASE("select: allocates nothing in steady state, standing or moving") {
  EvenPlanet planet;
  Flight flight(planet);
  const SelectionSettings settings;
  const auto camera = [&](int i) { return camera_at(planet.ellipsoid, 20, 30 + 0.0005 * (i % 40), 20000, 0.5 * (i % 40), -20); };
  for (int i = 0; i < 160; ++i) REQUIRE(flight.finish(camera(i), settings) != nullptr);
  const std::size_t before = allocations;
  for (int i = 0; i < 200; ++i) flight.tree.select(camera(i), settings, flight.now);
  CHECK(allocations == before);
  delete new int;  // the counter counts
  CHECK(allocations == before + 1);
}

TEST_CASE("select: is quick") {
  EvenPlanet planet;
  planet.root_error = 40000;
  planet.colour_level = 20;
  for (const double sse : {4.0, 2.0, 1.0}) {
    Flight flight(planet);
    SelectionSettings settings;
    settings.sse_px = sse;
    const view::Camera camera = camera_at(planet.ellipsoid, 46.7, -121.76, 6500, 0, -10);
    const Selection* finished = flight.finish(camera, settings);
    REQUIRE(finished != nullptr);
    double best_ms = 1e9;
    for (int i = 0; i < 200; ++i) {
      const auto start = std::chrono::steady_clock::now();
      flight.tree.select(camera, settings, flight.now);
      best_ms = std::min(best_ms, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    }
    MESSAGE(finished->stats.tiles_drawn << " tiles, " << finished->stats.tiles_visited << " visited: " << best_ms << " ms");
    CHECK(best_ms < 0.01 * finished->stats.tiles_drawn);
  }
}
