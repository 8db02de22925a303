// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The properties of a raster, known before its samples are read.
struct RasterInfo {
  std::string format;  ///< "geotiff", ...
  std::vector<std::string> files;
  std::uint64_t columns = 0, rows = 0;
  Channel sample;  ///< type, scale, offset and unit of the raw samples
  WorldTransform world;
  Crs crs;
  std::optional<double> nodata;  ///< in raw units; from the first file
  /// The size of the blocks in which the raster is stored. Windows that consist of complete blocks
  /// decode each block once.
  std::uint64_t block_columns = 1, block_rows = 1;
  /// Maximum memory in bytes that the open raster takes for reading, besides the caller's window;
  /// for a mosaic, that of its largest file.
  std::uint64_t held_bytes = 0;
  std::vector<std::string> comments;
  /// Comments that users should see without asking for them (see SourceInfo::note).
  std::vector<std::string> notes{};
};

/// A rectangle of cells.
struct CellWindow {
  std::uint64_t column = 0, row = 0;    ///< position of its first cell
  std::uint64_t columns = 0, rows = 0;  ///< its size
};

/// The destination of `Raster::read_over`. Cell (c, r) of the window is element r * stride + c.
/// `valid` is 0 for cells without data and 1 otherwise.
struct CellBuffer {
  std::byte* samples = nullptr;  ///< values of RasterInfo::sample.type in native byte order
  std::uint8_t* valid = nullptr;
  std::size_t stride = 0;  ///< cells from one row to the next
};

/// A raster that is read by windows. Not thread-safe.
///
/// A cell has no data if it equals the nodata value, is NaN or infinite, is in a block that a file
/// with a nodata value omits, or if the transparency mask of a GeoTIFF is 0 there.
/// RasterOptions::nodata overrides the file's nodata value.
class Raster {
 public:
  virtual ~Raster() = default;

  [[nodiscard]] virtual const RasterInfo& info() const = 0;
  /// Writes the valid samples of `window` over the contents of `out`, sets their `valid` to 1 and
  /// leaves every other cell alone. Returns whether it wrote any. Reading windows downwards, and
  /// from left to right in the same rows, is cheap; other orders may decode blocks again. Throws:
  /// Error naming file and block.
  virtual bool read_over(const CellWindow& window, const CellBuffer& out) = 0;
  /// Sets how many bytes the open members of a mosaic may hold from now on (see open_mosaic).
  virtual void set_open_bytes(std::uint64_t /*bytes*/) {}
};

/// Options of opening a raster.
struct RasterOptions {
  int band = 1;  ///< counted from 1
  /// Maximum size of a decoded block in bytes. Larger strips, and large strips of the usual codecs,
  /// are decoded row by row.
  std::uint64_t memory_bytes = 64u << 20;
  /// Cache size in bytes, for decoded blocks of which a window has used only a part.
  std::uint64_t cache_bytes = 16u << 20;
  HeightsOfColour heights_of_colour = HeightsOfColour::none;  ///< see SourceOptions
  /// The nodata value as text, which overrides the file's; empty text: no value stands for nodata.
  std::optional<std::string> nodata{};
};

/// Fractions of a cell. A mosaic's member whose cells are off those of the whole by up to
/// kNearestCell is placed on the nearest cells. A note reports it if they are off by more than
/// kSameCell.
inline constexpr double kNearestCell = 0.05, kSameCell = 1e-3;

/// Opens a GeoTIFF: strips and tiles, classic and BigTIFF, every codec of the installed libtiff,
/// integers and floats of up to 64 bits, any band. Overviews are skipped. Never maps the file.
///
/// `world` maps to the sample's position, which is the centre of the cell for PixelIsArea. A file
/// without georeferencing is placed by its world file (.tfw, .tifw, .wld). Without a world file it
/// is a plain grid of unit cells with y = -row, which a comment reports. A file whose
/// georeferencing is only several tie points is refused. Throws: Error.
std::unique_ptr<Raster> open_geotiff(const std::string& file, const RasterOptions& options = {});

/// Reopens a member of a mosaic.
using RasterOpener = std::function<std::unique_ptr<Raster>(const std::string& file)>;

/// Joins several rasters to one. Where they overlap, the valid sample of the file named last wins.
/// They must agree in sample (type, scale, offset), cell size and phase (to kNearestCell), and in
/// CRS (see SourceOptions::same_crs) unless `crs` is given for all. Files on both sides of the
/// antimeridian are joined there, with longitudes beyond 180, if the union is then at most 180
/// degrees wide. Keeps at most `open_at_once` files open, which together hold at most `open_bytes`
/// (see RasterInfo::held_bytes), but at least one. Throws: Error if two files do not agree, naming
/// them and the difference, or if the union has 2^30 columns or rows.
std::unique_ptr<Raster> open_mosaic(const std::vector<std::string>& files,
                                    const RasterOpener& opener,
                                    const std::optional<Crs>& crs = std::nullopt,
                                    std::size_t open_at_once = 32,
                                    std::uint64_t open_bytes = 64u << 20,
                                    const SameCrs& same_crs = {});

/// Delivers the cells of a raster as points (see Schema::grid), in tiles that are square on the
/// ground, of at most `options.block_points` cells, one block each. The raster is read in windows
/// of at least about 16 x 16 tiles, fewer if they would not fit into three quarters of
/// `options.memory_bytes`. Within a window the tiles follow a Hilbert curve. Memory beyond 64 MiB
/// does not enlarge the window, so more memory does not change the order. 64-bit integers have the
/// attribute "sample".
std::unique_ptr<PointSource> points_of(std::unique_ptr<Raster> raster,
                                       const SourceOptions& options = {});

}  // namespace terrace::stream
