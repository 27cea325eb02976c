// A part of an error table as a file: what surface::scan_part has found.
// Functions of values; they read and write files. Numbers are as memory holds them, under a checksum.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "surface/error_scan.h"

namespace tellurion::prepare {

/// Whole or not at all. Errors: unavailable, naming the file and what to do.
Result<void> save_scan(const surface::PartScan& scan, const std::filesystem::path& file);

/// Errors: not_found; corrupt (of another root, cut off, damaged): make it again.
Result<surface::PartScan> load_scan(const std::filesystem::path& file, const geo::TileKey& root);

}  // namespace tellurion::prepare
