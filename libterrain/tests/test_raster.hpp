// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include <terrace/stream/geotiff_writer.hpp>

namespace terrace::tests {

/// Writes a GeoTIFF of 16-bit samples, height(column, row). options: size, georeference, CRS,
/// nodata.
template <class Height>
void write_test_raster(const std::filesystem::path& path, stream::GeoTiffOptions options,
                       const Height& height) {
  options.sample.type = stream::ScalarType::i16;
  std::vector<std::int16_t> samples;
  samples.reserve(std::size_t{options.columns} * options.rows);
  for (std::uint32_t row = 0; row < options.rows; ++row) {
    for (std::uint32_t column = 0; column < options.columns; ++column) {
      samples.push_back(static_cast<std::int16_t>(height(column, row)));
    }
  }
  stream::GeoTiffWriter writer(path, options);
  writer.write_rows(std::as_bytes(std::span(samples)));
  writer.commit();
}

}  // namespace terrace::tests
