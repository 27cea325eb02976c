#include "source/gdal/gdal_reader.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "raster/box_average.h"
#include "source/proj/raise_heights.h"
#include "source/undeclared_voids.h"

namespace tellurion::source {
namespace {

constexpr int kPieceSamples = 1 << 15;  ///< read at a time where many are averaged

std::size_t area(const PixelWindow& window) { return static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height); }

/// The window in pieces of few samples, those of a block of the file one after the other: it is decoded once.
std::vector<PixelWindow> pieces_of(const PixelWindow& window, int block_width, int block_height) {
  const int right = window.x + window.width;
  const int bottom = window.y + window.height;
  // What each step goes to: the next border of a block, or of several that are a piece together.
  const auto next_border = [](int from, int block, int most, int end) { return std::min((from / block + std::max(most / block, 1)) * block, end); };
  std::vector<PixelWindow> pieces;
  for (int y = window.y, below = y; y < bottom; y = below) {
    below = next_border(y, block_height, kPieceSamples / std::min(block_width, window.width), bottom);
    for (int x = window.x, beside = x; x < right; x = beside) {
      beside = next_border(x, block_width, kPieceSamples / (below - y), right);
      const int rows = std::max(kPieceSamples / (beside - x), 1);
      for (int row = y; row < below; row += rows) pieces.push_back({x, row, beside - x, std::min(rows, below - row)});
    }
  }
  return pieces;
}

}  // namespace

GdalReader::GdalReader(std::shared_ptr<const GdalLayout> layout, PixelMapping mapping, std::optional<VerticalDatum> datum)
    : layout_(std::move(layout)), mapping_(std::move(mapping)), datum_(std::move(datum)) {}

Result<std::unique_ptr<GdalReader>> GdalReader::open(std::shared_ptr<const GdalLayout> layout) {
  Result<PixelMapping> mapping = PixelMapping::create(layout->georeference, layout->world);
  if (!mapping) return mapping.error();
  std::optional<VerticalDatum> datum;
  if (!layout->vertical.empty()) {
    Result<VerticalDatum> made = VerticalDatum::create(layout->vertical, layout->world);
    if (!made) return made.error();
    datum = std::move(made).value();
  }
  std::unique_ptr<GdalReader> reader(new GdalReader(std::move(layout), std::move(mapping).value(), std::move(datum)));
  if (reader->layout_->remote) return reader;  // a read opens it, without waiting
  if (Result<void> opened = reader->open_again(); !opened) return opened.error();
  return reader;
}

Result<void> GdalReader::open_again() {
  if (layout_->remote) {
    Result<RemoteDataset> opened = open_remote_tiff(layout_->remote, &awaited_);
    if (!opened) return opened.error();
    dataset_ = std::move(opened->dataset);
    mount_ = std::move(opened->mount);
    blocks_ = std::make_unique<RemoteBlocks>(*mount_);
  } else {
    Result<GDALDatasetUniquePtr> opened = open_dataset(layout_->file);
    if (!opened) return opened.error();
    dataset_ = std::move(opened).value();
  }
  const LevelSize& full = layout_->description.levels.front();
  if (dataset_->GetRasterXSize() == full.width && dataset_->GetRasterYSize() == full.height &&
      dataset_->GetRasterCount() == layout_->description.band_count)
    return {};
  return {ErrorCode::unavailable, fmt::format("{}: has changed since it was opened; open it again", layout_->options.path)};
}

/// Before a read of a remote file.
Result<void> GdalReader::begin() { return dataset_ ? Result<void>() : open_again(); }

/// After a read of a remote file, which ended with `error` or none.
void GdalReader::end(const Error* error) {
  if (!blocks_) return;
  for (auto& arrival : blocks_->take_awaited()) awaited_.push_back(std::move(arrival));
  if (error && error->code == ErrorCode::corrupt) blocks_->reject(error->message);
  blocks_->release();
  if (!mount_->failure()) return;
  blocks_.reset();
  dataset_.reset();
  mount_.reset();
}

Awaited GdalReader::take_awaited() { return std::exchange(awaited_, {}); }

GDALRasterBand& GdalReader::band(int number, int overview) const {
  GDALRasterBand* full = dataset_->GetRasterBand(number);
  GDALRasterBand* smaller = overview >= 0 ? full->GetOverview(overview) : nullptr;
  return smaller != nullptr ? *smaller : *full;
}

Result<void> GdalReader::read_samples(GDALRasterBand& from, const PixelWindow& window, std::vector<double>& samples) const {
  if (blocks_) {
    if (Result<void> brought = blocks_->bring(from, window); !brought) return brought;
  }
  const QuietErrors quiet;
  samples.resize(area(window));
  const CPLErr status = from.RasterIO(GF_Read, window.x, window.y, window.width, window.height, samples.data(), window.width, window.height,
                                      GDT_Float64, 0, 0, nullptr);
  if (mount_ && mount_->failure()) return *mount_->failure();
  if (status == CE_None) return {};
  return {ErrorCode::corrupt, fmt::format("{}: cannot read columns {} to {} of rows {} to {}: {}", layout_->options.path, window.x,
                                          window.x + window.width - 1, window.y, window.y + window.height - 1, quiet.last())};
}

// --- Heights ---------------------------------------------------------------------------------------------------------

Result<raster::HeightGrid> GdalReader::heights_of_overview(int overview, const PixelWindow& window) const {
  const HeightPlan& plan = layout_->heights;
  GDALRasterBand& from = band(1, overview);
  std::vector<double> samples;
  Result<void> read = read_samples(from, window, samples);
  if (!read && read.error().code != ErrorCode::pending) return read.error();
  std::vector<double> mask;
  const int flags = from.GetMaskFlags();
  if ((flags & (GMF_ALL_VALID | GMF_NODATA)) == 0) {
    if (Result<void> mask_read = read_samples(*from.GetMaskBand(), window, mask); !mask_read) return mask_read.error();
  }
  if (!read) return read.error();
  const bool is_float = from.GetRasterDataType() == GDT_Float32;
  const double no_data = plan.no_data ? (is_float ? static_cast<double>(static_cast<float>(*plan.no_data)) : *plan.no_data)
                                      : std::numeric_limits<double>::quiet_NaN();
  raster::HeightGrid grid{window.width, window.height, std::vector<float>(samples.size(), raster::kNoHeight)};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double sample = samples[i];
    if (sample == no_data || (plan.int16_voids && is_int16_void(sample)) || (!mask.empty() && mask[i] == 0.0)) continue;
    const double metres = (sample * plan.scale + plan.offset) * plan.unit;
    if (std::abs(metres) <= plan.limit_metres) grid.metres[i] = static_cast<float>(metres);
  }
  return grid;
}

/// A level that the file lacks: the samples of a finer one, averaged piece by piece.
template <class Data, class Read>
Result<Data> GdalReader::averaged(int level, const PixelWindow& window, const Read& read) const {
  const LevelSize size = layout_->description.levels[static_cast<std::size_t>(level)];
  const int overview = layout_->levels[static_cast<std::size_t>(level)].overview;
  GDALRasterBand& fine = band(layout_->description.kind == SampleKind::height ? 1 : layout_->colours.bands.front(), overview);
  const double step_x = static_cast<double>(fine.GetXSize()) / size.width;
  const double step_y = static_cast<double>(fine.GetYSize()) / size.height;
  raster::BoxAverage average({window.width, window.height, window.x * step_x, window.y * step_y, step_x, step_y});
  const int left = static_cast<int>(std::floor(window.x * step_x));
  const int right = std::min(static_cast<int>(std::ceil((window.x + window.width) * step_x)), fine.GetXSize());
  const int top = static_cast<int>(std::floor(window.y * step_y));
  const int bottom = std::min(static_cast<int>(std::ceil((window.y + window.height) * step_y)), fine.GetYSize());
  int block_width = 1;
  int block_height = 1;
  fine.GetBlockSize(&block_width, &block_height);
  bool pending = false;
  for (const PixelWindow& piece : pieces_of({left, top, right - left, bottom - top}, block_width, block_height)) {
    Result<Data> samples = read(overview, piece);
    if (!samples && samples.error().code == ErrorCode::pending) pending = true;  // the others are asked for too
    else if (!samples) return samples.error();
    if (pending) continue;
    average.add(samples.value(), piece.x, piece.y);
  }
  if (pending) return Error{ErrorCode::pending, layout_->options.path};
  if constexpr (std::is_same_v<Data, raster::HeightGrid>) {
    return average.heights();
  } else {
    return average.image();
  }
}

Result<raster::HeightGrid> GdalReader::read_heights(int level, const PixelWindow& window) {
  const QuietErrors quiet;
  if (Result<void> begun = begin(); !begun) return begun.error();
  const LevelPlan& plan = layout_->levels[static_cast<std::size_t>(level)];
  const auto read = [this](int overview, const PixelWindow& part) { return heights_of_overview(overview, part); };
  Result<raster::HeightGrid> grid = plan.direct ? read(plan.overview, window) : averaged<raster::HeightGrid>(level, window, read);
  end(grid ? nullptr : &grid.error());
  if (grid && datum_) raise_to_ellipsoid(grid.value(), layout_->description, level, window, mapping_, *datum_);
  return grid;
}

// --- Colours ---------------------------------------------------------------------------------------------------------

Result<raster::Image> GdalReader::colours_of_overview(int overview, const PixelWindow& window) const {
  const ColourPlan& plan = layout_->colours;
  const std::size_t count = area(window);
  raster::Image image{window.width, window.height, std::vector<std::uint8_t>(count * 4)};
  std::vector<std::vector<double>> samples(plan.bands.size());
  bool pending = false;  // bands that lie apart are asked for together
  const auto read_all = [&](GDALRasterBand& from, std::vector<double>& into) {
    Result<void> read = read_samples(from, window, into);
    if (read || read.error().code != ErrorCode::pending) return read;
    pending = true;
    return Result<void>();
  };
  for (std::size_t b = 0; b < plan.bands.size(); ++b) {
    if (Result<void> read = read_all(band(plan.bands[b], overview), samples[b]); !read) return read.error();
  }
  std::vector<double> alpha;
  double full_alpha = 255.0;
  GDALRasterBand& first = band(plan.bands.front(), overview);
  if (plan.alpha_band) {
    GDALRasterBand& from = band(plan.alpha_band, overview);
    if (Result<void> read = read_all(from, alpha); !read) return read.error();
    if (from.GetRasterDataType() == GDT_UInt16) full_alpha = 65535.0;
  } else if ((first.GetMaskFlags() & (GMF_ALL_VALID | GMF_NODATA)) == 0) {
    if (Result<void> read = read_all(*first.GetMaskBand(), alpha); !read) return read.error();
  }
  if (pending) return Error{ErrorCode::pending, layout_->options.path};

  const bool has_no_data = std::all_of(plan.no_data.begin(), plan.no_data.end(), [](const auto& value) { return value.has_value(); });
  for (std::size_t i = 0; i < count; ++i) {
    bool is_void = has_no_data;
    for (std::size_t b = 0; is_void && b < samples.size(); ++b) is_void = samples[b][i] == *plan.no_data[b];
    std::uint8_t* out = &image.rgba[i * 4];
    if (plan.model == ColourModel::palette) {
      const double index = samples[0][i];
      if (!is_void && index >= 0.0 && index < static_cast<double>(plan.palette.size())) {
        const std::array<std::uint8_t, 4>& colour = plan.palette[static_cast<std::size_t>(index)];
        std::copy(colour.begin(), colour.end(), out);
      }
      continue;
    }
    std::array<double, 4> unit{};  // each 0..1
    for (std::size_t b = 0; b < samples.size(); ++b) {
      unit[b] = std::clamp((samples[b][i] - ranges_[b].low) / (ranges_[b].high - ranges_[b].low), 0.0, 1.0);
      is_void = is_void || !std::isfinite(samples[b][i]);
    }
    const double opacity = is_void ? 0.0 : (alpha.empty() ? 1.0 : std::clamp(alpha[i] / full_alpha, 0.0, 1.0));
    if (opacity == 0.0) continue;
    const auto encoded = [opacity](double c) { return static_cast<std::uint8_t>(c * opacity * 255.0 + 0.5); };
    if (plan.model == ColourModel::cmyk) {
      for (std::size_t c = 0; c < 3; ++c) out[c] = encoded((1.0 - unit[c]) * (1.0 - unit[3]));
    } else {
      for (std::size_t c = 0; c < 3; ++c) out[c] = encoded(unit[plan.model == ColourModel::rgb ? c : 0]);
    }
    out[3] = static_cast<std::uint8_t>(opacity * 255.0 + 0.5);
  }
  return image;
}

/// What is black and what is white: of 8-bit bands known; of others the 2nd and 98th percentile of 16 x 16 windows of
/// 16 x 16 samples spread evenly over the raster's coarsest own level, so that every reader finds the same.
Result<void> GdalReader::find_ranges() {
  const ColourPlan& plan = layout_->colours;
  std::vector<Range> ranges;
  bool pending = false;
  for (std::size_t b = 0; b < plan.bands.size(); ++b) {
    if (plan.full_scale) {
      ranges.push_back({0.0, *plan.full_scale});
      continue;
    }
    GDALRasterBand& from = band(plan.bands[b], layout_->levels.back().overview);
    std::vector<double> all;
    std::vector<double> samples;
    constexpr int kWindows = 16;
    for (int w = 0; w < kWindows * kWindows; ++w) {
      const int width = std::max(1, std::min(16, from.GetXSize() / kWindows));
      const int height = std::max(1, std::min(16, from.GetYSize() / kWindows));
      const auto place = [](int i, int size, int part) { return static_cast<int>((static_cast<long long>(size) - part) * i / (kWindows - 1)); };
      const PixelWindow window{place(w % kWindows, from.GetXSize(), width), place(w / kWindows, from.GetYSize(), height), width, height};
      if (Result<void> read = read_samples(from, window, samples); !read) {
        if (read.error().code != ErrorCode::pending) return read;
        pending = true;
        continue;
      }
      for (const double sample : samples) {
        if (std::isfinite(sample) && !(plan.no_data[b] && sample == *plan.no_data[b])) all.push_back(sample);
      }
    }
    Range range;
    if (!all.empty()) {
      const auto at = [&](double share) {
        const auto nth = all.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(all.size() - 1));
        std::nth_element(all.begin(), nth, all.end());
        return *nth;
      };
      range = {at(0.02), at(0.98)};
      if (!(range.high > range.low)) range = {range.low, range.low + 1.0};
    }
    ranges.push_back(range);
  }
  if (pending) return {ErrorCode::pending, layout_->options.path};
  ranges_ = std::move(ranges);
  return {};
}

Result<raster::Image> GdalReader::read_colours(int level, const PixelWindow& window) {
  const QuietErrors quiet;
  if (Result<void> begun = begin(); !begun) return begun.error();
  if (ranges_.empty()) {
    if (Result<void> found = find_ranges(); !found) {
      end(&found.error());
      return found.error();
    }
  }
  const LevelPlan& plan = layout_->levels[static_cast<std::size_t>(level)];
  const auto read = [this](int overview, const PixelWindow& part) { return colours_of_overview(overview, part); };
  Result<raster::Image> image = plan.direct ? read(plan.overview, window) : averaged<raster::Image>(level, window, read);
  end(image ? nullptr : &image.error());
  return image;
}

}  // namespace tellurion::source
