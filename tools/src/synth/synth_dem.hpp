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

using namespace terrain;

struct SynthDemOptions {
  ImageSize size{4096, 4096};
  double cell = 30.0;  ///< side of a cell, in units of the CRS
  double hurst = 0.8;
  double roughness = 2.65;
  bool floats = false;  ///< float32 samples; else int16
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
  double base = 0.0;  ///< mean height of the endless plane it is cut from
  double minimum = 0.0, maximum = 0.0, rms_step = 0.0;  ///< as written
};

/// Writes a fractal DEM (see Fractal) as a tiled GeoTIFF, tile row by tile row. Heights lie about
/// four standard deviations of the endless plane above 0, which is where all but the rarest of them
/// stay; int16 heights never overflow: a roughness that could make them is refused.
/// A raster of at most 2^22 cells is measured first and its roughness set right; larger ones have
/// it within 1 % by the law of large numbers. progress(cells done) is called now and then, by any
/// thread, one at a time. Throws: UsageError, stream::Error, stream::Stopped.
SynthDemResult write_synth_dem(const std::string& path, const SynthDemOptions& options,
                               const std::function<void(std::uint64_t)>& progress);

}  // namespace terrace::tools
