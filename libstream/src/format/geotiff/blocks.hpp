// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "format/geotiff/handle.hpp"
#include "format/geotiff/layout.hpp"
#include "raster/nodata.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// Reads windows of one band block by block. Blocks that a window uses only in part are kept,
/// within the cache size, for the window that uses the rest.
class GeoTiffBlocks {
 public:
  /// Throws: Error if a decoded block is larger than `memory_bytes`.
  GeoTiffBlocks(GeoTiffHandle& handle, const GeoTiffLayout& layout, NodataRule nodata,
                std::uint64_t memory_bytes, std::uint64_t cache_bytes);

  /// From now on, cells without data in `mask` have no data here. The mask must have the same size
  /// and outlive this object.
  void set_mask(GeoTiffBlocks& mask) { mask_ = &mask; }
  /// Maximum bytes held between windows: see RasterInfo::held_bytes.
  [[nodiscard]] std::uint64_t held_bytes() const;

  /// See Raster::read_over.
  bool read_over(const CellWindow& window, const CellBuffer& out);

 private:
  /// The part of a block that a window covers, and its destination.
  struct Part {
    std::uint32_t across, down;  // the block
    std::uint32_t column, row;   // of the part, within the block
    std::uint32_t columns, rows;
    std::byte* samples;
    std::uint8_t* valid;
  };

  [[nodiscard]] std::uint64_t block_bytes() const {
    return layout_.row_bytes() * layout_.block_rows;
  }
  [[nodiscard]] std::uint64_t max_stored() const;
  bool read_block(const Part& part, const CellBuffer& out);
  bool read_plain(const Part& part, std::uint64_t offset, std::uint64_t bytes,
                  const CellBuffer& out);
  bool read_by_rows(const Part& part, const CellBuffer& out);
  bool fill_sparse(const Part& part, const CellBuffer& out);
  bool overlay_part_row(const Part& part, const std::byte* stored, std::uint32_t column,
                        std::uint32_t row, const CellBuffer& out);
  bool overlay_cells(const Part& part, const SampleRow& samples, std::uint32_t row,
                     const CellBuffer& out);
  const std::vector<std::byte>& decoded(const Part& part, std::uint64_t offset,
                                        std::uint64_t bytes);
  void decode(const Part& part, std::uint64_t offset, std::uint64_t bytes);
  [[nodiscard]] Error fault(const Part& part, std::uint64_t offset, std::string cause) const;

  GeoTiffHandle& handle_;
  GeoTiffLayout layout_;
  NodataRule nodata_;
  std::uint64_t memory_bytes_, cache_bytes_;
  bool by_rows_ = false;                  // strips are decoded row by row
  std::uint64_t max_stored_ = 0;          // bytes of the largest block in the file
  std::uint64_t next_row_ = 0;            // of the raster: what libtiff decodes next, if by_rows_
  std::vector<std::byte> raw_;            // as stored
  std::vector<std::byte> block_;          // decoded, native byte order
  std::optional<std::uint32_t> decoded_;  // the block in block_
  std::vector<std::byte> wide_;           // an unpacked row of packed samples
  GeoTiffBlocks* mask_ = nullptr;
  std::vector<std::byte> mask_samples_;  // of a row
  std::vector<std::uint8_t> unmasked_;

  struct Cached {
    std::uint32_t block;
    std::vector<std::byte> samples;
  };
  std::list<Cached> cache_;  // most recent first
  std::unordered_map<std::uint32_t, std::list<Cached>::iterator> cached_;
};

}  // namespace terrace::stream
