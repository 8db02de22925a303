// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "terrace/stream/error.hpp"
#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// The octree of the points (COPC, EPT): its nodes down to a depth are a thinned cloud.
struct OctreeInfo {
  double spacing = 0.0;     ///< spacing of the root's points, in the CRS; halves with each depth
  unsigned depths = 0;      ///< depths with points among the nodes to read; the root's is 0
  std::uint64_t nodes = 0;  ///< nodes with points to read
};

/// The properties of a source, known before its first point.
struct SourceInfo : Schema {
  std::string format;              ///< "geotiff", "xyz", "ply", ...
  std::vector<std::string> files;  ///< as the caller named them
  /// Bounds of the points in stored coordinates, as the files state them. They may be wrong:
  /// nothing may be left out because of them.
  std::optional<Box3> stated_bounds;
  /// The number of points if known; an upper bound for what has nodata: rasters, PLY, meshes.
  std::optional<std::uint64_t> points;
  std::optional<double> nodata;      ///< of the (first) raster, in raw units
  std::optional<OctreeInfo> octree;  ///< of a single input organised as an octree
  std::vector<std::string> comments;
  std::string note;  ///< for people: how several files were brought together; empty if as they are
  /// Bytes in temporary files that hold input from pipes or gzip for random access.
  std::uint64_t spooled_bytes = 0;
};

/// A block of points in *stored coordinates* (see WorldTransform). Every coordinate type except
/// 64-bit integers is exact in a double; a raster of 64-bit integers has its samples also as the
/// attribute "sample", which is the authoritative value.
/// Points of a block are close together: consumers cluster a block as a whole.
struct PointBlock {
  std::vector<Point3> positions;
  std::vector<std::byte> payload;  ///< Schema::payload_size() bytes per point: packed attributes

  [[nodiscard]] std::size_t size() const { return positions.size(); }
  [[nodiscard]] bool empty() const { return positions.empty(); }
  void clear() {
    positions.clear();
    payload.clear();
  }
};

/// The progress of a source. Bytes refer to the input files, if the source knows them.
struct Progress {
  std::uint64_t points = 0;
  /// Left out: cells without data; of XYZ, CSV, PLY, meshes and arrays points (entities) of which a
  /// coordinate is NaN (in text also an empty field or NA). Infinite coordinates are errors.
  std::uint64_t nodata = 0;
  /// Attributes of the points that their text leaves empty or NA: they are NaN.
  std::uint64_t empty_values = 0;
  /// Points among them that their file marks as withheld (LAS): they are delivered like all others.
  std::uint64_t withheld = 0;
  /// Points left out by Selection::where, region and resolution, whether they were read or not; of
  /// rasters cells that were not read, whatever they hold.
  std::uint64_t excluded = 0;
  std::uint64_t lost = 0;  ///< points of damaged parts, left out (see SourceOptions::on_damage)
  double fraction = 0.0;   ///< share of the work, 0 to 1; 0 if unknown
};

/// A stream of points, pulled block by block. Bounded memory; never seeks back to what it has
/// delivered. Not thread-safe; `read_ahead` moves the work to a separate thread.
class PointSource {
 public:
  virtual ~PointSource() = default;

  [[nodiscard]] virtual const SourceInfo& info() const = 0;
  /// Fills `block` (cleared first; its capacity is reused). False at the end, with an empty block.
  /// A block never has more than SourceOptions::block_points points. Throws: Error for bad data,
  /// naming file, place, cause and remedy; Stopped.
  virtual bool next(PointBlock& block) = 0;
  [[nodiscard]] virtual Progress progress() const = 0;
  /// Sets what a caller of a raster knows only after info(): the height / width of a cell on the
  /// ground, so that tiles are square there (until then the transform counts), and
  /// SourceOptions::memory_bytes again. To be called before the first next(). Without effect on
  /// other sources.
  virtual void refine(double /*cell_aspect*/, std::uint64_t /*memory_bytes*/) {}
  /// Minimum memory of reading in bytes: for a raster, the window and what its file holds, which
  /// depends on its layout. 0 if only the blocks count.
  [[nodiscard]] virtual std::uint64_t reading_bytes() const { return 0; }
};

/// Selects a part of a source.
struct Selection {
  /// Points that do not meet this condition (see Where) are left out; empty: all points are kept.
  std::string where{};
  /// Names of the attributes to keep, in the order of the file; nullopt: all. Conditions see all of
  /// them.
  std::optional<std::vector<std::string>> keep{};
  std::vector<std::string> drop{};  ///< names of attributes to leave out
  /// Points outside of this box, in the source's CRS, are left out; without heights its z are
  /// infinite. Of rasters also those within a millionth of a cell are inside. Rasters, COPC and EPT
  /// are read only as far as needed; a raster's columns and rows count from its first cell near the
  /// box.
  std::optional<Box3> region{};
  /// Points in `region` at whose x, y this is false are left out too; empty: no others are.
  /// Called by the thread that reads.
  std::function<bool(const std::array<double, 2>& place)> covers{};
  /// Above 0: points of an octree's nodes down to the first depth whose spacing is at most this, in
  /// units of the CRS. Formats without an octree are refused.
  double resolution = 0.0;
};

/// How the colours of a PNG encode heights in metres, with R, G, B from 0 to 255:
/// mapbox -10000 + (R * 65536 + G * 256 + B) / 10, terrarium R * 256 + G + B / 256 - 32768.
enum class HeightsOfColour : std::uint8_t { none, mapbox, terrarium };

/// Called for a damaged part of a LAS, LAZ, COPC or EPT that is left out (a chunk, a node, the
/// missing end of a truncated file), with the number of points it should have had; 0 if it holds no
/// points. Called by the reading thread. Damage on which all points depend is still thrown.
using OnDamage = std::function<void(const Error& damage, std::uint64_t points)>;

/// What a source delivers from a file. Entities of several corners are points too: the position is
/// that of the first corner, the attributes are the other corners, of the coordinates' type, bit
/// for bit. Other attributes are left out.
enum class Entities : std::uint8_t {
  points,  ///< of meshes and GeoJSON: the vertices
  /// The triangles of a mesh (GLB, OBJ, OFF, PLY, STL), polygons cut into fans, in the order of the
  /// file: "x2", "y2", "z2", "x3", "y3", "z3".
  triangles,
  /// The segments of lines (GeoJSON, including rings of polygons), in the order of the file: "x2",
  /// "y2", "z2"; then "line", numbered from 0 over all files, "part", the segment's number in its
  /// line, "vertices", which is 2, and "dimensions", 3 if the line has heights, otherwise 2. Points
  /// are left out and counted as excluded.
  segments,
  /// Lines in pieces of at most kPolylineVertices vertices, where the last of each piece is the
  /// first of the next: "x2" to "z4" and the columns of segments. Missing corners of a piece are 0.
  polylines,
};
/// Maximum number of vertices of an entity of Entities::polylines.
inline constexpr std::size_t kPolylineVertices = 4;
/// "points", "triangles", "segments", "polylines".
std::string_view name_of(Entities entities);
/// The entities of that name; nullopt for other names.
std::optional<Entities> entities_named(std::string_view name);

/// Whether two descriptions mean the same CRS, however they are written.
using SameCrs = std::function<bool(const Crs&, const Crs&)>;

/// Options of any source.
struct SourceOptions {
  std::string format{};  ///< name of a registered format; empty: by content, then ending
  Entities entities = Entities::points;
  std::size_t block_points = 10000;        ///< maximum number of points per block
  std::uint64_t memory_bytes = 64u << 20;  ///< approximate memory limit of the source
  int band = 1;                            ///< of rasters, counted from 1
  HeightsOfColour heights_of_colour = HeightsOfColour::none;  ///< of PNG images in colour
  double cell = 0.0;         ///< above 0: side of the cells of rasters without georeferencing
  std::optional<Crs> crs{};  ///< replaces what the file says
  /// Asked where the descriptions of several files differ; empty: then they do not agree.
  SameCrs same_crs{};
  /// Ends any wait for a pipe, in opening the source and in next(), with Stopped.
  std::stop_token stop{};
  /// Above 0: blocks are read on a separate thread, at most this many ahead (see read_ahead()). The
  /// source's destructor does not wait for a pipe.
  std::size_t blocks_ahead = 0;
  unsigned threads = 1;  ///< decoding threads, for formats with independent parts (LAZ, EPT)
  OnDamage on_damage{};  ///< empty: damage is thrown
  Selection selection{};
};

/// Opens one file, or several as one source: rasters form a mosaic (same CRS, cell size and phase;
/// where they overlap the valid sample last named wins), other formats follow one another and must
/// agree in CRS and in the attributes that the selection keeps or its condition names. "-" is
/// standard input (streaming formats only). A folder stands for all files in it, recursively, whose
/// names have an ending of a format (SourceOptions::format, if given), in the order of their paths;
/// a folder with an ept.json for that dataset. "@LIST" stands for the names on the lines of LIST,
/// relative to its folder, without blank lines and those that begin with #; a name with *, ? or
/// [...] that is not an existing file for the files that match the pattern, in which a part ** of
/// the path stands for any number of folders. Throws: Error, Stopped;
/// std::invalid_argument for a format that is not known, without a name, or for blocks of 0 points.
std::unique_ptr<PointSource> open_source(std::span<const std::string> names,
                                         const SourceOptions& options = {});

/// NAME.prj beside NAME.tif and the like, where ESRI's formats have their CRS; empty if there is
/// none.
[[nodiscard]] std::string prj_beside(const std::string& file);

/// The same stream, read on a separate thread, at most `blocks` blocks ahead. An Error thrown there
/// is rethrown by the `next` that would have delivered the block. The thread starts at once, that
/// of a raster with the first `next`, as refine() comes before it; if none can be started the
/// caller's thread reads. reading: the stop source of `source`; a stop is requested by `stop` and
/// when the object is destroyed, so that its destructor does not wait for a pipe.
std::unique_ptr<PointSource> read_ahead(
    std::unique_ptr<PointSource> source, std::size_t blocks = 8,
    const std::stop_source& reading = std::stop_source(std::nostopstate),
    const std::stop_token& stop = {});

/// A format in the registry. `recognise` sees the first bytes of a file, up to 4096.
struct Format {
  std::string name;
  std::vector<std::string> endings;  ///< lower case, with the dot: ".tif"
  bool streams = false;              ///< can be read from a pipe, front to back
  /// A format that does not stream can be read from a copy: neither its name nor files next to it
  /// matter.
  bool self_contained = false;
  bool (*recognise)(std::span<const std::byte> head) = nullptr;
  std::unique_ptr<PointSource> (*open)(std::span<const std::string> files,
                                       const SourceOptions& options) = nullptr;
  bool triangles = false;  ///< can be opened as Entities::triangles too
  bool lines = false;      ///< can be opened as Entities::segments and polylines too
};

/// All readable formats; a new one is one more entry.
std::span<const Format> formats();

}  // namespace terrace::stream
