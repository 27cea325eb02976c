// Finished pictures and measurements as files.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "base/result.h"
#include "raster/image.h"
#include "render/renderer.h"

namespace tellurion::globe {

/// PNG, whole or not at all. Errors: unavailable, naming the file.
Result<void> write_png(const std::filesystem::path& file, const raster::Image& image);

/// A float64 TIFF of four bands: latitude, longitude (degrees), height and distance (m). Errors: unavailable, naming the file.
Result<void> write_geo_tiff(const std::filesystem::path& file, const render::GeoPicture& picture);

/// A video made by the program ffmpeg (H.264 in MP4). Pictures are handed over one by one.
class VideoWriter {
 public:
  /// Errors: unavailable (ffmpeg is not installed, the file cannot be written).
  static Result<std::unique_ptr<VideoWriter>> open(const std::filesystem::path& file, int width, int height, double frames_per_second);
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  Result<void> add(const raster::Image& image);
  /// Waits for ffmpeg to finish the file.
  Result<void> close();

 private:
  VideoWriter(std::filesystem::path file, std::FILE* pipe) : file_(std::move(file)), pipe_(pipe) {}
  std::filesystem::path file_;
  std::FILE* pipe_ = nullptr;
};

}  // namespace tellurion::globe
