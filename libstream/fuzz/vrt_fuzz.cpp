// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "format/vrt/document.hpp"
#include "fuzz_points.hpp"

/// Any bytes are a virtual raster whose sources lie within it, or refused.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  const MemoryFile file(data, size);
  try {
    const VrtDocument document = read_vrt(file.name(), 1);
    const RasterInfo& info = document.info;
    require(info.columns > 0 && info.rows > 0, "cells");
    for (const double number : info.world.xy) require(std::isfinite(number), "a place");
    for (const VrtSource& source : document.sources) {
      require(!source.file.empty(), "the name of a file");
      require(source.columns > 0 && source.column + source.columns <= info.columns, "its columns");
      require(source.rows > 0 && source.row + source.rows <= info.rows, "its rows");
    }
  } catch (const Error& error) {
    require(!error.parts().cause.empty(), "a cause");
  }
  return 0;
}
