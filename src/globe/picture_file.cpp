#include "globe/picture_file.h"

#include <array>
#include <csignal>
#include <cstdlib>

#include <fmt/format.h>

#include "source/gdal/picture_file.h"

namespace tellurion::globe {
namespace {

/// `text` as one word for the shell.
std::string quoted(const std::string& text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

}  // namespace

Result<void> write_png(const std::filesystem::path& file, const raster::Image& image) { return source::write_png(file, image); }

Result<void> write_geo_tiff(const std::filesystem::path& file, const render::GeoPicture& p) {
  const std::array<std::span<const double>, 4> bands{p.latitude, p.longitude, p.elevation, p.distance};
  const std::array<std::string, 4> names{"latitude (degrees)", "longitude (degrees)", "height above the ellipsoid (m)",
                                         "distance from the eye (m)"};
  return source::write_float64_tiff(file, p.width, p.height, bands, names);
}

Result<std::unique_ptr<VideoWriter>> VideoWriter::open(const std::filesystem::path& file, int width, int height,
                                                       double frames_per_second) {
  if (std::system("command -v ffmpeg >/dev/null 2>&1") != 0)
    return Error{ErrorCode::unavailable, fmt::format("{}: videos are made by ffmpeg, which is not installed", file.string())};
  std::signal(SIGPIPE, SIG_IGN);  // an ffmpeg that stops early is an error of add, not the end of this program
  // yuv420p needs even sides.
  const std::string command = fmt::format(
      "ffmpeg -loglevel error -y -f rawvideo -pix_fmt rgba -s {}x{} -r {} -i - -vf 'pad=ceil(iw/2)*2:ceil(ih/2)*2' "
      "-c:v libx264 -preset medium -crf 18 -pix_fmt yuv420p -movflags +faststart {}",
      width, height, frames_per_second, quoted(std::filesystem::absolute(file).string()));
  std::FILE* pipe = popen(command.c_str(), "w");
  if (!pipe) return Error{ErrorCode::unavailable, fmt::format("{}: ffmpeg could not be started", file.string())};
  return std::unique_ptr<VideoWriter>(new VideoWriter(file, pipe));
}

VideoWriter::~VideoWriter() {
  if (pipe_) pclose(pipe_);
}

Result<void> VideoWriter::add(const raster::Image& image) {
  if (std::fwrite(image.rgba.data(), 1, image.rgba.size(), pipe_) != image.rgba.size())
    return Error{ErrorCode::unavailable, fmt::format("{}: ffmpeg stopped taking pictures", file_.string())};
  return {};
}

Result<void> VideoWriter::close() {
  const int status = pclose(pipe_);
  pipe_ = nullptr;
  if (status != 0) return Error{ErrorCode::unavailable, fmt::format("{}: ffmpeg could not write the video", file_.string())};
  return {};
}

}  // namespace tellurion::globe
