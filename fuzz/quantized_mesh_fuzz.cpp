// Quantized meshes of any bytes: read or refused with a message; what is read can be rasterised in bounded time.
// rooms: raster
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "raster/quantized_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion::raster;
  const auto mesh = decode_quantized_mesh({reinterpret_cast<const char*>(data), size});
  if (!mesh) {
    if (mesh.error().message.empty()) std::abort();
    return 0;
  }
  for (const std::uint32_t vertex : mesh->triangles) {
    if (vertex >= mesh->vertices.size()) std::abort();
  }
  constexpr int kSide = 32;
  const auto grid = rasterise(*mesh, kSide, even_rows(kSide));
  if (!grid) return 0;
  const double slack = 1e-6 * (std::abs(mesh->lowest) + std::abs(mesh->highest));
  for (const float metres : grid->metres) {
    const auto height = static_cast<double>(metres);
    if (!std::isnan(metres) && !(height >= mesh->lowest - slack && height <= mesh->highest + slack)) std::abort();
  }
  return 0;
}
