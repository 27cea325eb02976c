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

// With sanitizers gcc inlines one of the pair and takes malloc and delete for a mismatch.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  std::abort();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
#pragma GCC diagnostic pop

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
