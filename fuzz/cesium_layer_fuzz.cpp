// layer.json files of any bytes: read or refused with a message; what is read names tiles absolutely and within bounds.
// rooms: source
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "source/tiles/cesium_layer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion::source;
  const auto layer = parse_cesium_layer({reinterpret_cast<const char*>(data), size}, "https://user:word@host/a/layer.json?key=1");
  if (!layer) {
    if (layer.error().message.empty()) std::abort();
    return 0;
  }
  if (!layer->url.starts_with("http://") && !layer->url.starts_with("https://")) std::abort();
  if (layer->max_zoom && (*layer->max_zoom < 0 || *layer->max_zoom > 30)) std::abort();
  if (layer->bounds && !((*layer->bounds)[0] < (*layer->bounds)[2] && (*layer->bounds)[1] < (*layer->bounds)[3])) std::abort();
  layer->may_have({2, 1, 1}, 4);
  return 0;
}
