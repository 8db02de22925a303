// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>

#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

enum class GeoTiffCompression { none, deflate, zstd };

/// What a cell of an overview says of the up to four cells below it that have data.
enum class GeoTiffOverviews {
  none,     ///< there are no overviews
  average,  ///< their mean, integers rounded
  nearest,  ///< the first of them, by rows: for what has no mean, as directions
};

/// What a GeoTIFF of one band says of itself.
struct GeoTiffOptions {
  std::uint32_t columns = 0, rows = 0;
  Channel sample;               ///< type of the samples; scale, offset and unit unless default
  WorldTransform world;         ///< from column and row to the sample's position, as in SourceInfo
  bool pixel_is_point = false;  ///< a sample represents a point, not its cell's area
  Crs crs;                      ///< EPSG codes, otherwise its GeoKeys, and the name as a citation
  std::optional<double> nodata;
  GeoTiffCompression compression = GeoTiffCompression::deflate;
  int level = 7;             ///< of the compression: 1 to 12 (libdeflate's), 1 to 22 (zstd)
  bool predictor = true;     ///< code differences of neighbours: smaller for terrain
  std::uint32_t tile = 256;  ///< columns and rows of a tile, a multiple of 16
  GeoTiffOverviews overviews = GeoTiffOverviews::none;
  unsigned threads = 1;    ///< that compress tiles; they do not change the file
  Naming replace{};        ///< of an existing file
  std::stop_token stop{};  ///< ends commit() of a file with overviews, with Stopped
};

/// Bytes that a writer takes at most for the table of the file's tiles.
std::uint64_t geotiff_table_bytes(const GeoTiffOptions& options);

/// Writes a tiled GeoTIFF of one band, in rows from the top or in tiles in any order; BigTIFF where
/// 4 GiB might not do. The file appears whole and synced with `commit()`, or not at all (see
/// AtomicFile). Holds one row of tiles when it is given rows, where each tile is, and for each of
/// several threads two tiles that are to be compressed.
///
/// With overviews it is a Cloud Optimized GeoTIFF (OGC 21-026): overviews of half the columns and
/// rows each, down to 512 x 512 cells, all directories before the tiles and the smallest overview
/// first. Tiles wait in a temporary file without a name beside the target, which takes as much disk
/// again until the file stands. Of overviews their unfinished tiles are held: one for each overview
/// if tiles come in the order of a quadtree, half a row of them for each if they come by rows.
class GeoTiffWriter {
 public:
  /// Throws: Error if the file cannot be made.
  GeoTiffWriter(const std::filesystem::path& path, const GeoTiffOptions& options);
  ~GeoTiffWriter();
  GeoTiffWriter(GeoTiffWriter&&) noexcept;
  GeoTiffWriter& operator=(GeoTiffWriter&&) noexcept;

  /// The next rows from the top: native samples, any number of complete rows.
  void write_rows(std::span<const std::byte> samples);
  /// One tile, `options.tile` squared native samples by rows; what hangs over the raster's edge is
  /// ignored. Tiles never written are left out of the file: readers take them for nodata, or 0. So
  /// are those without samples here, of which overviews need not wait for others. Not to be mixed
  /// with `write_rows`.
  void write_tile(std::uint32_t across, std::uint32_t down, std::span<const std::byte> samples);
  /// Publishes the file. After `write_rows` all rows must have been written.
  void commit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::stream
