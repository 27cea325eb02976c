#include "globe/surface_steps.h"

#include <functional>
#include <set>
#include <utility>

#include <doctest/doctest.h>

#include "globe/slot_ages.h"
#include "source/debug/tile_index.h"

using namespace tellurion;
using namespace tellurion::globe;

namespace {

UtcTime utc(const char* text) { return parse_utc(text).value(); }

/// A layer of the years 2000, 2010 and 2020 over one without times; says which paths were opened, and cannot open 2010.
struct Steps {
  std::vector<std::string> opened;
  std::function<void()> while_opening;  ///< called once
  SurfaceSteps steps;

  static LayerInfo fixed() {
    LayerInfo layer;
    layer.spec.name = "fixed";
    layer.raster = std::move(source::open_tile_index({}, geo::kWgs84)).value();
    return layer;
  }
  static LayerInfo timed() {
    LayerInfo layer;
    layer.spec.name = "timed";
    layer.spec.source.path = "/data/{time}.tif";
    layer.spec.source.time = source::TimeSpec{"%Y", {"2000", "2010", "2020"}, "", "", ""};
    return layer;
  }

  Steps() : steps(geo::kWgs84, {timed(), fixed()}, [this](const LayerSpec& spec) -> Result<std::unique_ptr<source::RasterSource>> {
    opened.push_back(spec.source.path.string());
    if (while_opening) std::exchange(while_opening, {})();
    if (opened.back() == "/data/2010.tif") return Error{ErrorCode::not_found, "/data/2010.tif: there is no such file"};
    return source::open_tile_index({true, 256}, geo::kWgs84);
  }) {}
};

}  // namespace

TEST_CASE("SurfaceSteps: the step that holds is shown, and opened once") {
  Steps made;
  const auto first = made.steps.at(utc("1990-01-01"));
  REQUIRE(first->colours.size() == 2);
  CHECK(first->colours[0].name == "timed");
  CHECK(made.opened == std::vector<std::string>{"/data/2000.tif"});
  CHECK(made.steps.at(utc("2009-12-31T23:59:59Z")) == first);
  const auto last = made.steps.at(utc("2020-01-01"));
  CHECK(last != first);
  CHECK(last->revision != first->revision);
  CHECK(last->colours[0].source_id != first->colours[0].source_id);
  CHECK(last->colours[0].source != first->colours[0].source);
  CHECK(last->colours[1].source == first->colours[1].source);
  CHECK(last->colours[1].source_id == first->colours[1].source_id);
  CHECK(made.steps.at(std::nullopt) == last);
  CHECK(made.steps.at(utc("2001-01-01")) == first);
  CHECK(made.opened.size() == 2);
  CHECK(made.steps.text_of(0, utc("2001-01-01")) == "2000");
  CHECK(made.steps.text_of(1, utc("2001-01-01")).empty());
}

TEST_CASE("SurfaceSteps: held_at gives what was asked for lately and opens nothing") {
  Steps made;
  CHECK(made.steps.held_at(utc("2000-01-01")) == nullptr);
  CHECK(made.opened.empty());
  const auto first = made.steps.at(utc("2000-01-01"));
  CHECK(made.steps.held_at(utc("2005-01-01")) == first);
  CHECK(made.steps.held_at(utc("2020-01-01")) == nullptr);
  CHECK(made.opened.size() == 1);
}

TEST_CASE("SurfaceSteps: a step that cannot be opened is left out and told of") {
  Steps made;
  CHECK(made.steps.failures_of(0).count == 0);
  const auto without = made.steps.at(utc("2015-01-01"));
  REQUIRE(without->colours.size() == 1);
  CHECK(without->colours[0].name == "fixed");
  CHECK(made.steps.failures_of(0).count == 1);
  CHECK(made.steps.failures_of(0).last_error == "/data/2010.tif: there is no such file");
  CHECK(made.steps.at(utc("2021-01-01"))->colours.size() == 2);
}

TEST_CASE("SurfaceSteps: steps are opened and read anew, also where they were being opened just then") {
  Steps made;
  const auto before = made.steps.at(utc("2000-01-01"));
  made.steps.reopen_steps(0);
  CHECK(made.steps.held_at(utc("2000-01-01")) == nullptr);
  made.while_opening = [&] { made.steps.reopen_steps(0); };
  const auto after = made.steps.at(utc("2000-01-01"));
  CHECK(made.opened.size() == 3);
  CHECK(after->colours[0].source != before->colours[0].source);
  CHECK(after->colours[0].source_id == before->colours[0].source_id);
  CHECK(after->colours[0].content == 2);
  CHECK(after->colours[1] == before->colours[1]);
  CHECK(made.steps.at(utc("2000-01-01")) == after);
  CHECK(made.opened.size() == 3);
}

TEST_CASE("SurfaceSteps: layers come over the others of their group and go, and the others keep their numbers") {
  Steps made;
  const auto before = made.steps.at(utc("2000-01-01"));
  LayerSpec heights;
  heights.group = LayerGroup::height;
  CHECK(made.steps.add(heights) == 2);
  CHECK(made.steps.held_at(utc("2000-01-01")) == before);  // it shows nothing yet
  CHECK(made.steps.order() == std::vector<std::size_t>{2, 0, 1});
  made.steps.set_source(2, made.steps.raster_at(1, {}));
  const auto with_heights = made.steps.held_at(utc("2000-01-01"));
  REQUIRE(with_heights->heights.size() == 1);

  CHECK(made.steps.add(Steps::timed().spec) == 3);
  CHECK(made.steps.held_at(utc("2000-01-01")) == nullptr);
  const auto twice = made.steps.at(utc("2000-01-01"));
  REQUIRE(twice->colours.size() == 3);
  CHECK(made.opened == std::vector<std::string>{"/data/2000.tif", "/data/2000.tif"});
  std::set<std::uint32_t> ids{twice->heights[0].source_id};
  for (const surface::Layer& layer : twice->colours) ids.insert(layer.source_id);
  CHECK(ids.size() == 4);
  CHECK(twice->colours[0].source_id == before->colours[0].source_id);

  made.steps.remove(0);
  const auto without = made.steps.held_at(utc("2000-01-01"));
  REQUIRE(without->colours.size() == 2);
  CHECK(without->colours[1].source_id == twice->colours[2].source_id);
  CHECK(made.steps.order() == std::vector<std::size_t>{2, 1, 3});
  CHECK_FALSE(made.steps.settings(0).enabled);
  made.steps.set_settings(0, {});
  made.steps.set_source(0, made.steps.raster_at(1, {}));
  CHECK(made.steps.at(utc("2000-01-01")) == without);
  CHECK_FALSE(made.steps.move(0, true));
  CHECK(made.steps.raster_at(0, utc("2000-01-01")) == nullptr);
}

TEST_CASE("SlotAges: slots that a changed layer touches are composed anew, once, as long as they are shown") {
  Steps made;
  const auto before = made.steps.at(utc("2000-01-01")), now = made.steps.at(utc("2020-01-01"));
  const geo::TileKey root{0, 0, 0, 0}, other{1, 0, 0, 0};
  const std::vector<surface::DrawTile> drawn{{.key = root, .colour_owner = root, .colour_before = root, .slope_owner = root}};
  const SlotAges::TimePoint start{};
  SlotAges slots(surface::Part::colour);
  slots.composed(root, true);
  slots.composed(other, true);
  CHECK_FALSE(slots.find(drawn, start).any);
  slots.layers_changed(*before, *before);
  CHECK_FALSE(slots.find(drawn, start).any);
  slots.layers_changed(*before, *now);
  CHECK(slots.find(drawn, start).to_ask == std::vector{root});
  slots.asked(root);
  SlotAges::Stale stale = slots.find(drawn, start);
  CHECK(stale.any);
  CHECK(stale.to_ask.empty());
  CHECK(slots.is_wanted(root));
  CHECK_FALSE(slots.is_wanted(other));
  slots.failed(root, start + std::chrono::seconds(2));
  CHECK(slots.find(drawn, start + std::chrono::seconds(1)).to_ask.empty());
  CHECK(slots.find(drawn, start + std::chrono::seconds(3)).to_ask == std::vector{root});
  slots.failed(root, SlotAges::TimePoint::max());
  stale = slots.find(drawn, start + std::chrono::hours(1));
  CHECK(stale.any);
  CHECK_FALSE(stale.may_change);
  slots.composed(root, true);
  CHECK_FALSE(slots.find(drawn, start).any);
  for (int frame = 0; frame < 5; ++frame) slots.find({}, start);
  CHECK_FALSE(slots.is_wanted(root));
}

TEST_CASE("SlotAges: a slot lacks a layer only where nothing that is shown has it") {
  const geo::TileKey root{0, 0, 0, 0}, child{0, 1, 0, 0}, grandchild{0, 2, 0, 0};
  const std::vector<surface::DrawTile> drawn{{.key = root, .colour_owner = root, .colour_before = root, .slope_owner = root}};
  const SlotAges::TimePoint start{};
  SlotAges slots(surface::Part::colour);
  CHECK(slots.may_lack(root, {3}));
  slots.composed_without(root, {3, 5}, start + std::chrono::seconds(5));
  CHECK(slots.may_lack(grandchild, {3}));
  CHECK(slots.may_lack(grandchild, {3, 5}));
  CHECK_FALSE(slots.may_lack(grandchild, {4}));
  CHECK(slots.may_lack(root, {5}));
  CHECK_FALSE(slots.may_lack(root, {3, 5}));
  slots.composed(child, true);
  CHECK_FALSE(slots.may_lack(grandchild, {3}));
  // It is old, and asked for again in time.
  CHECK(slots.find(drawn, start).any);
  CHECK(slots.find(drawn, start + std::chrono::seconds(4)).to_ask.empty());
  CHECK(slots.find(drawn, start + std::chrono::seconds(5)).to_ask == std::vector{root});
  slots.composed(root, true);
  CHECK_FALSE(slots.find(drawn, start).any);
}
