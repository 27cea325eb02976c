// The text form of flights; see flight.h.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>

#include "base/number.h"
#include "view/flight.h"

namespace tellurion::view {
namespace {

constexpr std::array<std::string_view, 7> kColumns{"time", "lat", "lon", "height", "heading", "pitch", "roll"};
constexpr std::array<double, 7> kLargest{1e9, 90.0, 1e6, 1e12,
                                         1e6, 90.0, 1e6};  ///< absolute values; angles may count turns
constexpr std::string_view kHeader = "time,lat,lon,height,heading,pitch,roll";
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Takes the text up to `separator` (or all) off the front of `rest`.
std::string_view take_until(std::string_view& rest, char separator) {
  const std::size_t end = rest.find(separator);
  const std::string_view taken = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  return taken;
}

std::string_view without_blanks_at_end(std::string_view line) {
  return line.substr(0, line.find_last_not_of(" \t\r") + 1);
}

/// One line of numbers, or what is wrong with it.
Result<std::array<double, 7>> parse_line(std::string_view line) {
  std::array<double, 7> numbers{};
  std::string_view rest = line;
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    if (i > 0 && rest.data() == line.data() + line.size() && line.back() != ',') {
      return Error{ErrorCode::corrupt, fmt::format("column {} is missing", kColumns[i])};
    }
    const std::string_view field = take_until(rest, ',');
    const std::optional<double> number = parse_number(field);
    if (!number) {
      return Error{ErrorCode::corrupt, fmt::format("column {}: '{}' is no number", kColumns[i], field.substr(0, 40))};
    }
    if (std::abs(*number) > kLargest[i]) {
      return Error{ErrorCode::corrupt,
                   fmt::format("column {}: {} is beyond {}", kColumns[i], field.substr(0, 40), kLargest[i])};
    }
    numbers[i] = *number;
  }
  if (!rest.empty() || line.back() == ',') return Error{ErrorCode::corrupt, "more than 7 columns"};
  return numbers;
}

FlightSample sample_of(const std::array<double, 7>& numbers) {
  const auto angle = [&](std::size_t column) { return to_radians(Degrees(numbers[column])); };
  return {numbers[0], {{angle(1), angle(2), EllipsoidalHeight(numbers[3])}, angle(4), angle(5), angle(6)}};
}

}  // namespace

Result<Flight> parse_flight(std::string_view text, std::string_view name) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  const auto fail = [&](std::size_t line, std::string_view why) {
    return Error{ErrorCode::corrupt, fmt::format("{}:{}: {}", name, line, why)};
  };
  if (without_blanks_at_end(take_until(text, '\n')) != kHeader) {
    return fail(1, fmt::format("the header is not '{}'", kHeader));
  }
  std::vector<FlightSample> samples;
  for (std::size_t line_number = 2; !text.empty(); ++line_number) {
    const std::string_view line = without_blanks_at_end(take_until(text, '\n'));
    if (line.empty()) continue;
    const Result<std::array<double, 7>> numbers = parse_line(line);
    if (!numbers) return fail(line_number, numbers.error().message);
    samples.push_back(sample_of(*numbers));
    if (samples.size() > 1 && !(samples.back().time_s - samples[samples.size() - 2].time_s >= kShortestStep_s)) {
      return fail(line_number, "column time: not at least 1e-6 s later than the line before");
    }
  }
  if (samples.empty()) return fail(2, "no samples after the header");
  Result<Flight> flight = Flight::create(std::move(samples));
  if (!flight) return Error{ErrorCode::corrupt, fmt::format("{}: {}", name, flight.error().message)};
  return flight;
}

Result<Flight> read_flight(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) {
    return Error{ErrorCode::not_found, fmt::format("flight {}: cannot be opened", path.string())};
  }
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (file.bad()) return Error{ErrorCode::unavailable, fmt::format("flight {}: cannot be read", path.string())};
  return parse_flight(text, path.string());
}

std::string format_flight(std::span<const FlightSample> samples) {
  std::string text = fmt::format("{}\n", kHeader);
  for (const FlightSample& sample : samples) {
    const Pose& pose = sample.pose;
    const auto degrees = [](Radians angle) { return to_degrees(angle).value; };
    fmt::format_to(std::back_inserter(text), "{:.6f},{:.10f},{:.10f},{:.6f},{:.10f},{:.10f},{:.10f}\n", sample.time_s,
                   degrees(pose.position.latitude), degrees(pose.position.longitude), pose.position.height.value,
                   degrees(pose.heading), degrees(pose.pitch), degrees(pose.roll));
  }
  return text;
}

Result<void> write_flight(const std::filesystem::path& path, std::span<const FlightSample> samples) {
  std::ofstream file(path, std::ios::binary);
  file << format_flight(samples);
  file.close();
  if (!file) return Error{ErrorCode::unavailable, fmt::format("flight {}: cannot be written", path.string())};
  return {};
}

}  // namespace tellurion::view
