// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "format/vrt/document.hpp"
#include "fuzz_points.hpp"

/// Any input is refused, or is a virtual raster whose sources are inside it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  const MemoryFile file(data, size);
  try {
    const VrtDocument document = read_vrt(file.name(), 1);
    const RasterInfo& info = document.info;
    require(info.columns > 0 && info.rows > 0, "the raster has cells");
    for (const double number : info.world.xy) require(std::isfinite(number), "places are finite");
    for (const VrtSource& source : document.sources) {
      require(!source.file.empty(), "a source has a file");
      require(source.columns > 0 && source.column + source.columns <= info.columns,
              "a source's columns are in the raster");
      require(source.rows > 0 && source.row + source.rows <= info.rows,
              "a source's rows are in the raster");
    }
  } catch (const Error& error) {
    require(!error.parts().cause.empty(), "errors have a cause");
  }
  return 0;
}
