// The groups of benchmarks, one file each.
#pragma once

#include <vector>

#include "bench/registry.h"

namespace tellurion::bench {

std::vector<Benchmark> frame_benchmarks();   ///< frame.*, cut.*: a finished view, frame by frame
std::vector<Benchmark> rtin_benchmarks();    ///< rtin.*: decimation against another implementation
std::vector<Benchmark> query_benchmarks();   ///< queries.*: point queries of heights
std::vector<Benchmark> tile_benchmarks();    ///< tile.*, scan.*: work of the workers
std::vector<Benchmark> start_benchmarks();   ///< start.*: from nothing to the first picture
std::vector<Benchmark> truth_benchmarks();   ///< truth.*: the picture against the elevation
std::vector<Benchmark> pole_benchmarks();    ///< poles.*: a pole against the equator
std::vector<Benchmark> hole_benchmarks();    ///< holes.*: pixels that show the background
std::vector<Benchmark> memory_benchmarks();  ///< memory.*: what a long flight takes
std::vector<Benchmark> catalogue_benchmarks();  ///< catalogue.*: thousands of rasters as one layer
std::vector<Benchmark> layer_benchmarks();      ///< layers.*: many layers over one another
std::vector<Benchmark> ingest_benchmarks();     ///< ingest.*: preparation beside GDAL's programs

}  // namespace tellurion::bench
