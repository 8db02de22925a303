// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "base/units.hpp"
#include "synth/fractal.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::tools {

struct SynthDemOptions {
  terrain::ImageSize size{4096, 4096};
  double cell = 30.0;  ///< side of a cell, in units of the CRS
  double hurst = 0.8;
  double roughness = 2.65;
  bool floats = false;  ///< float32 samples instead of int16
  std::string compression = "none";
  stream::Crs crs;
  std::uint64_t seed = 1;
  unsigned threads = 1;
  std::uint64_t memory_bytes = std::uint64_t{256} << 20;
  stream::Naming replace{};
};

/// Measurements of a fractal DEM.
struct SynthDemResult {
  std::uint64_t bytes = 0;
  double base = 0.0;                                    ///< mean height of the infinite plane
  double minimum = 0.0, maximum = 0.0, rms_step = 0.0;  ///< values of the written samples
};

/// Writes a fractal DEM (see Fractal) as a tiled GeoTIFF, one row of tiles at a time. The mean
/// height is about four standard deviations of the infinite plane, so nearly all heights are
/// positive. Rasters of at most 2^22 cells are measured first and their roughness is corrected.
/// Larger ones have the roughness within 1 % by the law of large numbers.
///
/// Calls progress(number of cells written) from time to time, from any thread but never
/// concurrently. Throws UsageError, also for a roughness that could overflow int16, stream::Error
/// and stream::Stopped.
SynthDemResult write_synth_dem(const std::string& path, const SynthDemOptions& options,
                               const std::function<void(std::uint64_t)>& progress);

}  // namespace terrace::tools
