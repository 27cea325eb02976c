#include "surface/tile_life.h"

#include <doctest/doctest.h>

using namespace tellurion::surface;

namespace {

const TimePoint kRetry = TimePoint{} + std::chrono::seconds(5);

}  // namespace

TEST_CASE("next_life: a part is fetched, arrives and is released") {
  PartLife life;
  CHECK(can_request(life, {}));
  life = next_life(life, Start{});
  CHECK(std::holds_alternative<Fetching>(life));
  CHECK_FALSE(can_request(life, {}));
  life = next_life(life, Arrive{{{-1, 3, {}, 1}, true}});
  REQUIRE(std::holds_alternative<Resident>(life));
  CHECK(std::get<Resident>(life).metrics.max_height == 3);
  CHECK(std::get<Resident>(life).has_slopes);
  CHECK(std::holds_alternative<Wanted>(next_life(life, Release{})));
}

TEST_CASE("next_life: a failed part may be asked for again when its time has come") {
  const PartLife failed = next_life(next_life(PartLife{}, Start{}), Fail{kRetry});
  CHECK_FALSE(can_request(failed, kRetry - std::chrono::nanoseconds(1)));
  CHECK(can_request(failed, kRetry));
  CHECK(std::holds_alternative<Fetching>(next_life(failed, Start{})));
}

TEST_CASE("next_life: cancelling ends a fetch and nothing else") {
  CHECK(std::holds_alternative<Wanted>(next_life(Fetching{}, Cancel{})));
  CHECK(std::holds_alternative<Failed>(next_life(Failed{kRetry}, Cancel{})));
  CHECK(std::holds_alternative<Resident>(next_life(Resident{}, Cancel{})));
}

TEST_CASE("next_life: what is resident stays until it is released, whatever a newer fetch does") {
  for (const PartEvent& event : {PartEvent(Start{}), PartEvent(Cancel{}), PartEvent(Fail{kRetry})}) {
    CHECK(std::holds_alternative<Resident>(next_life(Resident{}, event)));
  }
  const PartLife renewed = next_life(Resident{{0, 1, {}, 1}, false}, Arrive{{{0, 2, {}, 1}, false}});
  CHECK(std::get<Resident>(renewed).metrics.max_height == 2);
}
