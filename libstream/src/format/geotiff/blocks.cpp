// SPDX-License-Identifier: Apache-2.0
#include "format/geotiff/blocks.hpp"

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

#include <fmt/core.h>

#include "format/geotiff/layout.hpp"
#include "format/geotiff/tags.hpp"
#include "io/text.hpp"

namespace terrace::stream {
namespace {

constexpr char kDamaged[] = "the file is damaged or truncated: download it again";

/// Codecs may enlarge a block, but not by much.
constexpr std::uint64_t kMaxGrowth = 4, kMaxOverhead = 1u << 16;

/// Strips larger than this are decoded row by row if the codec can: a file of one strip then takes
/// no more memory than its compressed bytes.
constexpr std::uint64_t kMaxWholeStrip = 4u << 20;

constexpr std::uint64_t kRawBytes = 1u << 20;  // of an uncompressed block, read at a time

/// True if libtiff decodes a strip of this codec row by row without holding all of it decoded.
bool decodes_by_rows(std::uint16_t compression) {
  switch (compression) {
    case COMPRESSION_LZW:
    case COMPRESSION_PACKBITS:
    case COMPRESSION_ADOBE_DEFLATE:
    case COMPRESSION_DEFLATE:
    case COMPRESSION_LZMA:
    case COMPRESSION_ZSTD:
      return true;
    default:
      return false;
  }
}

/// Memory that a codec needs, besides input and output, while it decodes a block.
std::uint64_t codec_bytes(std::uint16_t compression, std::uint64_t block_bytes) {
  constexpr std::uint64_t kOther = 256u << 10, kZstdWindow = 8u << 20, kLzmaWindow = 64u << 20;
  switch (compression) {
    case COMPRESSION_NONE:
    case COMPRESSION_LZW:
    case COMPRESSION_PACKBITS:
    case COMPRESSION_ADOBE_DEFLATE:
    case COMPRESSION_DEFLATE:
      return kOther;
    case COMPRESSION_ZSTD:
      return kOther + std::min(block_bytes, kZstdWindow);
    case COMPRESSION_LZMA:
      return kOther + std::min(block_bytes, kLzmaWindow);
    default:
      return kOther + block_bytes;
  }
}

void swap_bytes(std::byte* samples, std::size_t size, std::size_t count) {
  const auto n = static_cast<tmsize_t>(count);
  switch (size) {
    case 2:
      TIFFSwabArrayOfShort(reinterpret_cast<std::uint16_t*>(samples), n);
      break;
    case 4:
      TIFFSwabArrayOfLong(reinterpret_cast<std::uint32_t*>(samples), n);
      break;
    case 8:
      TIFFSwabArrayOfLong8(reinterpret_cast<std::uint64_t*>(samples), n);
      break;
    default:
      break;
  }
}

}  // namespace

GeoTiffBlocks::GeoTiffBlocks(GeoTiffHandle& handle, const GeoTiffLayout& layout, NodataRule nodata,
                             std::uint64_t memory_bytes, std::uint64_t cache_bytes)
    : handle_(handle),
      layout_(layout),
      nodata_(nodata),
      memory_bytes_(memory_bytes),
      cache_bytes_(cache_bytes) {
  // The size of a row fits 64 bits, but that of a block may not (2^31 columns x 2^16 samples x 2^6
  // bits x 2^31 rows), so divide by the rows instead of multiplying.
  const std::uint64_t row = layout_.row_bytes();
  if (layout_.plain) return;
  max_stored_ = max_stored();
  const bool fits = row <= memory_bytes_ / layout_.block_rows;
  const bool large = !fits || block_bytes() > kMaxWholeStrip;
  by_rows_ = !layout_.tiled && row <= memory_bytes_ && large &&
             (!fits || decodes_by_rows(layout_.compression));
  if (fits || by_rows_) return;
  const bool countable = row <= UINT64_MAX / layout_.block_rows;
  throw handle_
      .fault(fmt::format(
          "{} of {} x {} cells need {} MiB each, the limit is {} MiB",
          layout_.tiled ? "tiles" : "strips", layout_.block_columns,
          layout_.tiled ? layout_.block_rows : 1,
          countable ? fmt::format("{}", (row * (layout_.tiled ? layout_.block_rows : 1) >> 20) + 1)
                    : "beyond 2^44",
          memory_bytes_ >> 20))
      .remedy("allow more memory, or convert it to small tiles: gdal_translate -co TILED=YES");
}

Error GeoTiffBlocks::fault(const Part& part, std::uint64_t offset, std::string cause) const {
  return handle_.fault(std::move(cause))
      .at(fmt::format("{} (byte {})", layout_.block_name(part.across, part.down), offset))
      .remedy(kDamaged);
}

/// Bytes of the largest block of the band, at most those of the file: larger claims are refused
/// when the block is read.
std::uint64_t GeoTiffBlocks::max_stored() const {
  std::uint64_t largest = 0;
  const std::uint32_t first = layout_.block(0, 0);
  const std::uint32_t count = layout_.blocks_across * layout_.blocks_down;
  for (std::uint32_t i = 0; i < count; ++i) {
    int failed = 0;
    const std::uint64_t bytes = TIFFGetStrileByteCountWithErr(handle_.tiff(), first + i, &failed);
    if (failed == 0) largest = std::max(largest, bytes);
  }
  handle_.take_complaint();
  return std::min(largest, handle_.file_bytes());
}

std::uint64_t GeoTiffBlocks::held_bytes() const {
  const std::uint64_t blocks = std::uint64_t{layout_.blocks_across} * layout_.blocks_down *
                               (layout_.separate ? layout_.bands : 1);
  const std::uint64_t tables = 2 * sizeof(std::uint64_t) * blocks;
  if (layout_.plain) return tables + std::max(kRawBytes, layout_.row_bytes());
  if (by_rows_) {
    const bool fits = layout_.row_bytes() <= memory_bytes_ / layout_.block_rows;
    return tables + codec_bytes(layout_.compression, fits ? block_bytes() : memory_bytes_) +
           max_stored_ + 2 * layout_.row_bytes();
  }
  // Never more than all blocks of the band, which are fewer than 2^32.
  const std::uint64_t cached_blocks = std::min<std::uint64_t>(
      std::uint64_t{layout_.blocks_across} * layout_.blocks_down, cache_bytes_ / block_bytes());
  return tables + codec_bytes(layout_.compression, block_bytes()) + max_stored_ +
         (1 + cached_blocks) * block_bytes();
}

bool GeoTiffBlocks::read_over(const CellWindow& window, const CellBuffer& out) {
  bool any = false;
  const auto bc = layout_.block_columns, br = layout_.block_rows;
  const auto column_end = static_cast<std::uint32_t>(window.column + window.columns);
  const auto row_end = static_cast<std::uint32_t>(window.row + window.rows);
  std::uint32_t next_row = 0;
  for (auto row = static_cast<std::uint32_t>(window.row); row < row_end; row = next_row) {
    const std::uint32_t down = row / br;
    next_row = static_cast<std::uint32_t>(
        std::min<std::uint64_t>((std::uint64_t{down} + 1) * br, row_end));
    std::uint32_t next_column = 0;
    for (auto column = static_cast<std::uint32_t>(window.column); column < column_end;
         column = next_column) {
      const std::uint32_t across = column / bc;
      next_column = static_cast<std::uint32_t>(
          std::min<std::uint64_t>((std::uint64_t{across} + 1) * bc, column_end));
      const std::size_t cell =
          (row - window.row) * out.stride + static_cast<std::size_t>(column - window.column);
      const Part part{.across = across,
                      .down = down,
                      .column = column - across * bc,
                      .row = row - down * br,
                      .columns = next_column - column,
                      .rows = next_row - row,
                      .samples = out.samples + cell * size_of(layout_.type),
                      .valid = out.valid + cell};
      any |= read_block(part, out);
    }
  }
  return any;
}

bool GeoTiffBlocks::read_block(const Part& part, const CellBuffer& out) {
  const std::uint32_t number = layout_.block(part.across, part.down);
  int failed = 0;
  const std::uint64_t offset = TIFFGetStrileOffsetWithErr(handle_.tiff(), number, &failed);
  const std::uint64_t bytes = TIFFGetStrileByteCountWithErr(handle_.tiff(), number, &failed);
  if (failed != 0) throw fault(part, 0, "has no offset in the file: " + handle_.take_complaint());
  if (bytes == 0) return fill_sparse(part, out);
  if (offset > handle_.file_bytes() || bytes > handle_.file_bytes() - offset) {
    throw fault(part, offset,
                fmt::format("claims {}, beyond the end of the file at byte {}",
                            counted(bytes, "byte"), handle_.file_bytes()));
  }
  if (layout_.plain) return read_plain(part, offset, bytes, out);
  if (by_rows_) {
    if (bytes > memory_bytes_) {
      throw fault(
          part, offset,
          fmt::format("needs {} MiB, the limit is {} MiB", (bytes >> 20) + 1, memory_bytes_ >> 20))
          .remedy("allow more memory, or convert it to tiles: gdal_translate -co TILED=YES");
    }
    return read_by_rows(part, out);
  }
  const std::vector<std::byte>& block = decoded(part, offset, bytes);
  bool any = false;
  for (std::uint32_t row = 0; row < part.rows; ++row) {
    const std::byte* const block_row = block.data() + (part.row + row) * layout_.row_bytes();
    any |= overlay_part_row(part, block_row, part.column, row, out);
  }
  return any;
}

/// Reads the needed rows of an uncompressed block directly from the file.
bool GeoTiffBlocks::read_plain(const Part& part, std::uint64_t offset, std::uint64_t bytes,
                               const CellBuffer& out) {
  const std::uint64_t row_bytes = layout_.row_bytes();
  const std::uint32_t rows = layout_.rows_in_image(part.down);
  if (bytes / row_bytes < rows) {
    throw fault(part, offset,
                fmt::format("has {} where {} of {} are expected", counted(bytes, "byte"),
                            counted(rows, "row"), counted(row_bytes, "byte")));
  }
  const std::uint64_t pixel_bytes = layout_.samples_per_pixel() * size_of(layout_.type);
  // Read reads_whole_rows rows, unless the part is so narrow that most bytes of a row would not be
  // used.
  const bool reads_whole_rows =
      part.columns >= layout_.block_columns / 4 && row_bytes <= memory_bytes_ / 4;
  const std::uint64_t piece_bytes = reads_whole_rows ? row_bytes : part.columns * pixel_bytes;
  const std::uint64_t skip = reads_whole_rows ? 0 : part.column * pixel_bytes;
  const auto at_once = static_cast<std::uint32_t>(
      reads_whole_rows ? std::clamp<std::uint64_t>(kRawBytes / row_bytes, 1, part.rows) : 1);
  bool any = false;
  for (std::uint32_t row = 0; row < part.rows; row += at_once) {
    const std::uint32_t n = std::min(at_once, part.rows - row);
    if (raw_.size() < n * piece_bytes) raw_.resize(n * piece_bytes);
    const std::span<std::byte> piece(raw_.data(), n * piece_bytes);
    const std::uint64_t row_offset = offset + (std::uint64_t{part.row} + row) * row_bytes + skip;
    if (!handle_.read(row_offset, piece))
      throw fault(part, row_offset, "extends beyond the end of the file");
    if (layout_.swapped) {
      swap_bytes(raw_.data(), size_of(layout_.type), piece.size() / size_of(layout_.type));
    }
    for (std::uint32_t i = 0; i < n; ++i) {
      any |= overlay_part_row(part, raw_.data() + i * piece_bytes,
                              reads_whole_rows ? part.column : 0, row + i, out);
    }
  }
  return any;
}

/// Reads from a large compressed strip, which libtiff decodes row by row, in order.
bool GeoTiffBlocks::read_by_rows(const Part& part, const CellBuffer& out) {
  if (block_.size() < layout_.row_bytes()) block_.resize(layout_.row_bytes());
  const std::uint64_t first = std::uint64_t{part.down} * layout_.block_rows + part.row;
  if (next_row_ > first) next_row_ = std::uint64_t{part.down} * layout_.block_rows;
  next_row_ = std::max(next_row_, std::uint64_t{part.down} * layout_.block_rows);
  const auto sample = static_cast<std::uint16_t>(layout_.separate ? layout_.band : 0);
  bool any = false;
  for (; next_row_ < first + part.rows; ++next_row_) {
    const auto row = static_cast<std::uint32_t>(next_row_);
    if (TIFFReadScanline(handle_.tiff(), block_.data(), row, sample) != 1) {
      throw fault(part, TIFFGetStrileOffset(handle_.tiff(), layout_.block(part.across, part.down)),
                  fmt::format("row {} cannot be decoded: {}", row, handle_.take_complaint()));
    }
    if (next_row_ < first) continue;
    any |= overlay_part_row(part, block_.data(), part.column,
                            static_cast<std::uint32_t>(next_row_ - first), out);
  }
  return any;
}

/// Fills cells of a block that the file omits: without data if there is a nodata value, even if the
/// file's is overridden; with zeros otherwise.
bool GeoTiffBlocks::fill_sparse(const Part& part, const CellBuffer& out) {
  if (nodata_.value || !handle_.text(kGdalNodata).empty()) return false;
  wide_.assign(part.columns * size_of(layout_.type), std::byte{0});
  bool any = false;
  for (std::uint32_t row = 0; row < part.rows; ++row) {
    any |=
        overlay_cells(part, {.samples = wide_.data(), .step = 1, .cells = part.columns}, row, out);
  }
  return any;
}

/// Overlays row `row` of the part; its first cell is number `column` of `stored`.
bool GeoTiffBlocks::overlay_part_row(const Part& part, const std::byte* stored,
                                     std::uint32_t column, std::uint32_t row,
                                     const CellBuffer& out) {
  const std::size_t size = size_of(layout_.type);
  const std::size_t step = layout_.samples_per_pixel();
  const std::size_t first = column * step + (layout_.separate ? 0 : layout_.band);
  SampleRow samples{.samples = stored + first * size, .step = step, .cells = part.columns};
  const PackedSamples packed{layout_.sample_format, layout_.bits, layout_.type};
  if (!is_native(packed)) {
    wide_.resize(part.columns * size);
    unpack_samples(packed, stored, first, step, part.columns, wide_.data());
    samples = {.samples = wide_.data(), .step = 1, .cells = part.columns};
  }
  return overlay_cells(part, samples, row, out);
}

bool GeoTiffBlocks::overlay_cells(const Part& part, const SampleRow& samples, std::uint32_t row,
                                  const CellBuffer& out) {
  const std::size_t size = size_of(layout_.type);
  std::byte* const target = part.samples + row * out.stride * size;
  std::uint8_t* const valid = part.valid + row * out.stride;
  if (mask_ == nullptr) return overlay_row(layout_.type, samples, nodata_, target, valid);
  mask_samples_.resize(part.columns * size_of(mask_->layout_.type));
  unmasked_.assign(part.columns, 0);
  mask_->read_over(
      {.column = std::uint64_t{part.across} * layout_.block_columns + part.column,
       .row = std::uint64_t{part.down} * layout_.block_rows + part.row + row,
       .columns = part.columns,
       .rows = 1},
      {.samples = mask_samples_.data(), .valid = unmasked_.data(), .stride = part.columns});
  bool any = false;
  for (auto begin = unmasked_.begin(); begin != unmasked_.end();) {
    begin = std::find(begin, unmasked_.end(), 1);
    const auto end = std::find(begin, unmasked_.end(), 0);
    const auto first = static_cast<std::size_t>(begin - unmasked_.begin());
    const SampleRow run{.samples = samples.samples + first * samples.step * size,
                        .step = samples.step,
                        .cells = static_cast<std::size_t>(end - begin)};
    any |= overlay_row(layout_.type, run, nodata_, target + first * size, valid + first);
    begin = end;
  }
  return any;
}

const std::vector<std::byte>& GeoTiffBlocks::decoded(const Part& part, std::uint64_t offset,
                                                     std::uint64_t bytes) {
  const std::uint32_t number = layout_.block(part.across, part.down);
  if (const auto entry = cached_.find(number); entry != cached_.end()) {
    cache_.splice(cache_.begin(), cache_, entry->second);
    return entry->second->samples;
  }
  if (decoded_ == number && !block_.empty()) return block_;
  decoded_.reset();
  decode(part, offset, bytes);
  const std::uint32_t rows = layout_.rows_in_image(part.down);
  const std::uint32_t columns =
      std::min(layout_.block_columns, layout_.columns - part.across * layout_.block_columns);
  if ((part.rows == rows && part.columns == columns) || block_.size() > cache_bytes_) {
    decoded_ = number;
    return block_;
  }
  const std::size_t room = static_cast<std::size_t>(cache_bytes_ / block_.size());
  if (cache_.size() >= room) {  // reuse the buffer of the oldest
    const auto oldest = std::prev(cache_.end());
    cached_.erase(oldest->block);
    std::swap(oldest->samples, block_);
    oldest->block = number;
    cache_.splice(cache_.begin(), cache_, oldest);
    cached_[number] = oldest;
    return oldest->samples;
  }
  cache_.push_front({number, std::exchange(block_, {})});
  cached_[number] = cache_.begin();
  return cache_.front().samples;
}

void GeoTiffBlocks::decode(const Part& part, std::uint64_t offset, std::uint64_t bytes) {
  // Some writers omit a tile's rows beyond the lower edge of the image.
  const std::uint64_t expected_bytes = layout_.row_bytes() * layout_.rows_in_image(part.down);
  if (bytes > kMaxGrowth * expected_bytes + kMaxOverhead) {
    throw fault(part, offset,
                fmt::format("claims {} for {} of samples", counted(bytes, "byte"),
                            counted(expected_bytes, "byte")));
  }
  if (raw_.size() < bytes) raw_.resize(bytes);
  if (!handle_.read(offset, std::span(raw_.data(), bytes))) {
    throw fault(part, offset, "extends beyond the end of the file");
  }
  const std::uint64_t block_bytes = layout_.row_bytes() * layout_.block_rows;
  if (block_.size() != block_bytes) block_.assign(block_bytes, std::byte{0});
  const std::uint32_t number = layout_.block(part.across, part.down);
  if (TIFFReadFromUserBuffer(handle_.tiff(), number, raw_.data(), static_cast<tmsize_t>(bytes),
                             block_.data(), static_cast<tmsize_t>(expected_bytes)) != 1) {
    throw fault(part, offset, "cannot be decoded: " + handle_.take_complaint());
  }
  handle_.take_complaint();
}

}  // namespace terrace::stream
