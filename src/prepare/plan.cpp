#include "prepare/plan.h"

#include <algorithm>
#include <cstdlib>
#include <exception>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/hash.h"
#include "prepare/pyramid.h"

namespace tellurion::prepare {
namespace {

using Json = nlohmann::json;

constexpr int kFormatVersion = 1;  ///< of plans and chunks: another one makes all chunks anew
constexpr int kChunkSide = 2048;
constexpr int kLargestSide = 16384;
constexpr int kWidestForRows = 8192;  ///< a strip of a chunk is in memory for each worker
constexpr std::int64_t kMostChunks = 4096;

Json to_json(const OutputPlan& plan) {
  Json bands = Json::array();
  for (const BandAbout& band : plan.bands) {
    bands.push_back({{"colour", band.colour}, {"description", band.description}, {"unit", band.unit}, {"scale", band.scale}, {"offset", band.offset}});
  }
  return {{"version", kFormatVersion},
          {"crs", plan.crs},
          {"transform", plan.transform},
          {"size", {plan.width, plan.height}},
          {"point_samples", plan.point_samples},
          {"type", static_cast<int>(plan.layout.type)},
          {"alpha", plan.layout.alpha},
          {"no_data", plan.layout.no_data ? fmt::format("{}", *plan.layout.no_data) : ""},  // JSON knows no NaN
          {"bands", std::move(bands)},
          {"compress", plan.codec.compress},
          {"predictor", plan.codec.predictor},
          {"level", plan.codec.level},
          {"quality", plan.codec.quality},
          {"block", plan.block},
          {"chunk", {plan.chunk_width, plan.chunk_height}}};
}

bool is_sound(const OutputPlan& plan) {
  const auto is_chunk_side = [&](int side) { return side >= plan.block && side <= (1 << 20) && side % plan.block == 0; };
  return plan.width > 0 && plan.height > 0 && (plan.block == 256 || plan.block == 512) && is_chunk_side(plan.chunk_width) && is_chunk_side(plan.chunk_height) &&
         plan.chunk_width % plan.chunk_height == 0 && plan.layout.bands > 0 && plan.layout.bands < 1000 && static_cast<int>(plan.layout.type) >= 0 &&
         plan.layout.type <= SampleType::f64 &&
         plan.chunk_hashes.size() == static_cast<std::size_t>(plan.chunk_columns()) * static_cast<std::size_t>(plan.chunk_rows());
}

}  // namespace

int OutputPlan::level_count() const {
  int count = 1;
  while (std::max(size_at(width, count - 1), size_at(height, count - 1)) > block) ++count;
  return count;
}

int OutputPlan::last_chunk_level() const {
  int level = 0;
  while (level + 1 < level_count() && (chunk_height >> (level + 1)) >= block) ++level;
  return level;
}

std::string OutputPlan::description() const { return to_json(*this).dump(); }

Chunk chunk_of(const OutputPlan& plan, int index) {
  const int x = index % plan.chunk_columns() * plan.chunk_width, y = index / plan.chunk_columns() * plan.chunk_height;
  return {index, x, y, std::min(plan.chunk_width, plan.width - x), std::min(plan.chunk_height, plan.height - y)};
}

void choose_chunks(OutputPlan& plan, int stored_row_pixels) {
  int side = kChunkSide;
  const auto chunks = [&] { return ((std::int64_t{plan.width} + side - 1) / side) * ((std::int64_t{plan.height} + side - 1) / side); };
  while (chunks() > kMostChunks && side < kLargestSide) side *= 2;
  plan.chunk_height = side;
  plan.chunk_width = side;
  while (plan.chunk_width < stored_row_pixels && plan.chunk_width < kWidestForRows) plan.chunk_width *= 2;
}

std::string chunk_file_name(const OutputPlan& plan, int index) {
  return fmt::format("chunk-{}-{}-{}.blocks", index / plan.chunk_columns(), index % plan.chunk_columns(), plan.chunk_hashes[static_cast<std::size_t>(index)]);
}

std::string to_text(const OutputPlan& plan) {
  Json json = to_json(plan);
  json["chunks"] = plan.chunk_hashes;
  return json.dump(1) + "\n";
}

Result<OutputPlan> plan_from_text(const std::string& text) {
  try {
    const Json json = Json::parse(text);
    if (json.at("version") != kFormatVersion) return {ErrorCode::unsupported, "is of another version of the program"};
    OutputPlan plan;
    plan.crs = json.at("crs");
    plan.transform = json.at("transform");
    plan.width = json.at("size").at(0);
    plan.height = json.at("size").at(1);
    plan.point_samples = json.at("point_samples");
    plan.layout.type = static_cast<SampleType>(json.at("type").get<int>());
    plan.layout.alpha = json.at("alpha");
    const std::string no_data = json.at("no_data");
    if (!no_data.empty()) plan.layout.no_data = std::strtod(no_data.c_str(), nullptr);
    for (const Json& band : json.at("bands")) {
      plan.bands.push_back({band.at("colour"), band.at("description"), band.at("unit"), band.at("scale"), band.at("offset")});
    }
    plan.layout.bands = static_cast<int>(plan.bands.size());
    plan.codec = {json.at("compress"), json.at("predictor"), json.at("level"), json.at("quality")};
    plan.block = json.at("block");
    plan.chunk_width = json.at("chunk").at(0);
    plan.chunk_height = json.at("chunk").at(1);
    plan.chunk_hashes = json.at("chunks").get<std::vector<std::string>>();
    if (!is_sound(plan)) return {ErrorCode::corrupt, "is damaged"};
    return plan;
  } catch (const std::exception&) {
    return {ErrorCode::corrupt, "is damaged"};
  }
}

}  // namespace tellurion::prepare
