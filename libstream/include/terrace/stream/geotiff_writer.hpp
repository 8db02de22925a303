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

/// How the value of an overview cell is computed from the up to four cells with data below it.
enum class GeoTiffOverviews {
  none,     ///< no overviews
  average,  ///< their mean, integers rounded
  nearest,  ///< the first by rows: for values without a mean, such as directions
};

/// The layout of a GeoTIFF of one band, and the metadata to write.
struct GeoTiffOptions {
  std::uint32_t columns = 0, rows = 0;
  Channel sample;               ///< type of the samples; scale, offset and unit, unless default
  WorldTransform world;         ///< from column and row to the sample's position, as in SourceInfo
  bool pixel_is_point = false;  ///< a sample represents a point, not its cell's area
  Crs crs;                      ///< EPSG codes, otherwise its GeoKeys, and the name as a citation
  std::optional<double> nodata;
  GeoTiffCompression compression = GeoTiffCompression::deflate;
  int level = 7;             ///< of the compression: 1 to 12 (libdeflate's), 1 to 22 (zstd)
  bool predictor = true;     ///< code differences of neighbours, which makes terrain smaller
  std::uint32_t tile = 256;  ///< columns and rows of a tile, a multiple of 16
  GeoTiffOverviews overviews = GeoTiffOverviews::none;
  unsigned threads = 1;    ///< number of threads that compress tiles; does not change the file
  Naming replace{};        ///< whether an existing file is replaced
  std::stop_token stop{};  ///< ends commit() of a file with overviews, with Stopped
};

/// Bytes between the header of a file with overviews and its first directory: a description of the
/// file's layout.
inline constexpr std::size_t kGeoTiffLayoutBytes = 184;

/// Upper bound of the memory in bytes that a writer needs for the table of the file's tiles.
std::uint64_t geotiff_table_bytes(const GeoTiffOptions& options);

/// Writes a tiled GeoTIFF of one band, by rows from the top or by tiles in any order; a BigTIFF if
/// 4 GiB might not suffice. The file appears complete and synced with `commit()`, or not at all
/// (see AtomicFile). Memory: the table of tiles, one row of tiles if written by rows, and with
/// several threads two uncompressed tiles for each.
///
/// With overviews it is a Cloud Optimized GeoTIFF (OGC 21-026). Each overview has half the columns
/// and rows of the one below, down to 512 x 512 cells. All directories precede the tiles, and the
/// smallest overview comes first. Until commit() ends, the tiles are kept in an unnamed temporary
/// file next to the target, which takes the same disk space again. Unfinished tiles of overviews
/// are held in memory: one per overview if tiles are written in quadtree order, half a row of tiles
/// per overview if by rows.
class GeoTiffWriter {
 public:
  /// Throws: Error if the file cannot be made.
  GeoTiffWriter(const std::filesystem::path& path, const GeoTiffOptions& options);
  ~GeoTiffWriter();
  GeoTiffWriter(GeoTiffWriter&&) noexcept;
  GeoTiffWriter& operator=(GeoTiffWriter&&) noexcept;

  /// Appends any number of complete rows of samples in native byte order, from the top.
  void write_rows(std::span<const std::byte> samples);
  /// Writes one tile, `options.tile` squared samples in native byte order by rows; those beyond the
  /// raster's edge are ignored. Tiles that are never written are left out of the file: readers take
  /// them for nodata, or 0. A tile with empty `samples` is left out too, and overviews do not wait
  /// for it. Must not be mixed with `write_rows`.
  void write_tile(std::uint32_t across, std::uint32_t down, std::span<const std::byte> samples);
  /// Publishes the file. If it is written by rows, all of them must have been written.
  void commit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::stream
