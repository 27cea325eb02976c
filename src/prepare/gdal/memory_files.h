// Virtual rasters in GDAL's memory.
// Not thread-safe; names are unique in the process.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include <cpl_vsi.h>
#include <fmt/format.h>

namespace tellurion::prepare {

/// Names of files in GDAL's memory, unlinked at the end.
class MemoryFiles {
 public:
  MemoryFiles() = default;
  ~MemoryFiles() {
    for (const std::string& name : names_) VSIUnlink(name.c_str());
  }
  MemoryFiles(const MemoryFiles&) = delete;
  MemoryFiles& operator=(const MemoryFiles&) = delete;

  std::string add() {
    static std::atomic<std::uint64_t> count{0};
    return names_.emplace_back(fmt::format("/vsimem/tellurion-ingest-{}.vrt", ++count));
  }

 private:
  std::vector<std::string> names_;
};

}  // namespace tellurion::prepare
