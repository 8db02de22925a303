// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "terrace/stream/point.hpp"

namespace terrace::stream {

/// The types of a column. Multi-byte values are little-endian on disk, native in memory.
enum class ScalarType : std::uint8_t { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };

/// Bytes of one value.
std::size_t size_of(ScalarType type);
/// "int8", "uint8", ..., "float32", "float64": the names in manifests and PLY headers.
std::string_view name_of(ScalarType type);
/// The type of that name (also PLY's "char", "uchar", "short", ...); nothing if there is none.
std::optional<ScalarType> scalar_type_of(std::string_view name);

/// A column of the points: what a stored value means. Real value = stored * scale + offset.
struct Channel {
  std::string name;
  ScalarType type = ScalarType::f64;
  double scale = 1.0;
  double offset = 0.0;
  std::string unit{};  ///< "metre", "foot", ...; empty if unknown

  friend bool operator==(const Channel&, const Channel&) = default;
};

/// A GeoKey of a GeoTIFF that tells of its CRS, as it stands in the file.
struct GeoKey {
  std::uint16_t key = 0;
  std::vector<double> values{};  ///< numbers of any type
  std::string text{};

  friend bool operator==(const GeoKey&, const GeoKey&) = default;
};

/// A coordinate reference system as the file names it. Nothing here interprets it.
struct Crs {
  int epsg = 0;                 ///< EPSG code of the horizontal CRS; 0 if none is given
  int vertical_epsg = 0;        ///< EPSG code of the vertical CRS; 0 if none is given
  std::string name;             ///< citation or name
  std::string wkt;              ///< WKT where the file has one
  bool geographic = false;      ///< x, y are longitude and latitude
  std::string horizontal_unit;  ///< "metre", "foot", "US survey foot", "degree"; empty if unknown
  std::string vertical_unit;    ///< likewise for heights
  /// A GeoTIFF's keys in ascending order: datum, projection, parameters. Not kept in a store.
  std::vector<GeoKey> geo_keys{};

  friend bool operator==(const Crs&, const Crs&) = default;
};

/// How the stored coordinates of a source relate to its CRS:
///   x = xy[0] * c0 + xy[1] * c1 + xy[2]
///   y = xy[3] * c0 + xy[4] * c1 + xy[5]
///   z = channel[2].scale * c2 + channel[2].offset
/// For a raster (c0, c1, c2) = (column, row, raw sample) and xy maps to the *sample's* place (the
/// centre of the cell for PixelIsArea). For points that are stored as they are, xy is the identity.
struct WorldTransform {
  std::array<double, 6> xy{1, 0, 0, 0, 1, 0};

  friend bool operator==(const WorldTransform&, const WorldTransform&) = default;
};

/// What is known of a source before its first point.
struct SourceInfo {
  std::string format;                  ///< "geotiff", "xyz", "ply", ...
  std::vector<std::string> files;      ///< as the caller named them
  bool grid = false;                   ///< coordinates are integer column, row and a raw sample
  std::array<Channel, 3> coordinates;  ///< of the stored coordinates c0, c1, c2
  std::vector<Channel> attributes;     ///< further columns, in order
  WorldTransform world;
  Crs crs;
  std::optional<Box3> bounds;           ///< in stored coordinates, if known beforehand
  std::uint64_t columns = 0, rows = 0;  ///< of the raster or mosaic; 0 otherwise
  std::optional<std::uint64_t> points;  ///< number of points if known; for rasters an upper bound
  std::optional<double> nodata;         ///< of the (first) raster, raw units
  std::vector<std::string> comments;
};

/// One column's values for a block of points, packed.
struct Column {
  ScalarType type = ScalarType::f64;
  std::vector<std::byte> bytes;

  template <class T>
  [[nodiscard]] std::span<const T> as() const {
    return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
  }
};

/// A block of points in *stored coordinates* (see WorldTransform). Every coordinate type but 64-bit
/// integers is exact in a double; a raster of 64-bit integers carries its samples once more as the
/// attribute "sample", which is the value that counts.
/// A block keeps points together that lie together: consumers cluster a block as a whole.
struct PointBlock {
  std::vector<Point3> positions;
  std::vector<Column> attributes;  ///< one per SourceInfo::attributes, each positions.size() long

  [[nodiscard]] std::size_t size() const { return positions.size(); }
  [[nodiscard]] bool empty() const { return positions.empty(); }
  void clear();
};

/// How far a source has come. Bytes are of the input files, where the source knows them.
struct Progress {
  std::uint64_t points = 0;
  std::uint64_t nodata = 0;  ///< cells without data, left out
  double fraction = 0.0;     ///< of the work, 0 to 1; 0 if unknown
};

/// A stream of points, pulled block by block. Bounded memory; never seeks backwards through what it
/// has delivered. Not thread-safe; `read_ahead` moves the work to a thread of its own.
class PointSource {
 public:
  virtual ~PointSource() = default;

  [[nodiscard]] virtual const SourceInfo& info() const = 0;
  /// Fills `block` (cleared first; its capacity is reused). False at the end, the block then empty.
  /// A block never has more than SourceOptions::block_points points.
  /// Throws: Error on bad data, naming file, place, cause and remedy; Stopped.
  virtual bool next(PointBlock& block) = 0;
  [[nodiscard]] virtual Progress progress() const = 0;
  /// What reading takes at least, in bytes: of a raster the window and what its file holds, which
  /// its layout decides. 0 where nothing but the blocks counts.
  [[nodiscard]] virtual std::uint64_t reading_bytes() const { return 0; }
};

/// What a caller may ask of any source.
struct SourceOptions {
  std::string format{};  ///< name of a registered format; empty: by content, then ending
  std::size_t block_points = 10000;        ///< most points per block
  std::uint64_t memory_bytes = 64u << 20;  ///< what the source may hold, roughly
  int band = 1;                            ///< of rasters, counted from 1
  double cell_aspect = 0.0;  ///< ground height/width of a raster's cell, so that tiles are
                             ///< square on the ground; 0: as the transform says
  std::optional<Crs> crs{};  ///< replaces what the file says
  /// Ends whatever waits for a pipe, in opening the source and in next(), with Stopped.
  std::stop_token stop{};
  /// Above 0: blocks are read on a thread of their own, at most so many ahead, from the first
  /// next() on (see read_ahead()). The source's destructor waits for no pipe.
  std::size_t blocks_ahead = 0;
};

/// Opens one file, or several as one source: rasters form a mosaic (same CRS, cell size and phase;
/// where they overlap the last named valid sample wins), other formats follow one another and must
/// agree in channels and CRS. "-" is standard input (formats that stream only).
/// Throws: Error, Stopped.
std::unique_ptr<PointSource> open_source(std::span<const std::string> files,
                                         const SourceOptions& options = {});

/// The same stream, read on a thread of its own, at most `blocks` blocks ahead. An Error thrown
/// there is thrown by the `next` that would have delivered the block. The thread starts with the
/// first `next`; where none can be had the caller's reads.
/// reading: the stop of `source`, asked for by `stop` and when the object goes, so that its
/// destructor waits for no pipe.
std::unique_ptr<PointSource> read_ahead(
    std::unique_ptr<PointSource> source, std::size_t blocks = 8,
    const std::stop_source& reading = std::stop_source(std::nostopstate),
    const std::stop_token& stop = {});

/// A format in the registry. `recognise` sees the first bytes of a file, up to 4096.
struct Format {
  std::string name;
  std::vector<std::string> endings;  ///< lower case, with the dot: ".tif"
  bool streams = false;              ///< can be read from a pipe, front to back
  bool (*recognise)(std::span<const std::byte> head) = nullptr;
  std::unique_ptr<PointSource> (*open)(std::span<const std::string> files,
                                       const SourceOptions& options) = nullptr;
};

/// All readable formats; a new one is one more entry.
std::span<const Format> formats();

}  // namespace terrace::stream
