// Capabilities of a WMS of any bytes: read or refused with a message; every layer can be resolved.
// rooms: source
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "source/tiles/bounded_xml.h"
#include "source/tiles/wms_capabilities.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tellurion::source;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (const auto said = service_exception(bytes); said && (said->empty() || said->size() > 1000)) std::abort();
  const auto service = parse_wms_capabilities(bytes);
  if (!service) {
    if (service.error().message.empty()) std::abort();
    return 0;
  }
  for (const WmsLayer& layer : service->layers) {
    const WmsLayer all = service->resolved(layer);
    if (all.crs.size() < layer.crs.size() || (all.bounds && !((*all.bounds)[0] < (*all.bounds)[2]))) std::abort();
  }
  return 0;
}
