// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "terrace/stream/geotiff_writer.hpp"

struct libdeflate_compressor;

namespace terrace::stream {

/// Compresses the tiles of a GeoTIFF: applies the predictor, then the compression of the options.
class TileEncoder {
 public:
  explicit TileEncoder(const GeoTiffOptions& options);
  ~TileEncoder();
  TileEncoder(const TileEncoder&) = delete;
  TileEncoder& operator=(const TileEncoder&) = delete;

  /// samples: of a whole tile; overwritten. The result is valid until the next call.
  std::span<const std::byte> encode(std::span<std::byte> samples);

 private:
  void difference(std::span<std::byte> samples);

  GeoTiffOptions options_;
  libdeflate_compressor* deflate_ = nullptr;
  std::vector<std::byte> row_, coded_;
};

}  // namespace terrace::stream
