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

/// The octree of the points (COPC, EPT). Its nodes down to a depth are a thinned cloud.
struct OctreeInfo {
  double spacing = 0.0;     ///< spacing of the root's points, in the CRS; halves with each depth
  unsigned depths = 0;      ///< number of depths with points to read; the root has depth 0
  std::uint64_t nodes = 0;  ///< nodes with points to read
};

/// The properties of a source, known before its first point.
struct SourceInfo : Schema {
  std::string format;              ///< "geotiff", "xyz", "ply", ...
  std::vector<std::string> files;  ///< as the caller named them
  /// Bounds of the points in stored coordinates, as the files state them. They may be wrong, so
  /// points must not be left out because of them.
  std::optional<Box3> stated_bounds;
  /// The number of points if known; an upper bound for formats with nodata: rasters, PLY, meshes.
  std::optional<std::uint64_t> points;
  std::optional<double> nodata;      ///< of the (first) raster, in raw units
  std::optional<OctreeInfo> octree;  ///< of a single input organised as an octree
  /// True for points from meshes that may have faces, so that opening the files again as
  /// Entities::triangles may deliver some.
  bool faces = false;
  std::vector<std::string> comments;
  /// For users: how several files were brought together; empty if they were used as they are.
  std::string note;
  /// Size in bytes of temporary files that hold input from pipes or gzip for random access.
  std::uint64_t spooled_bytes = 0;
};

/// A block of points in *stored coordinates* (see WorldTransform). Every coordinate type except
/// 64-bit integers is exact in a double; a raster of 64-bit integers also has the attribute
/// "sample", which holds the exact value.
/// Points of a block are close together, because consumers cluster a block as a whole.
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

/// The progress of a source.
struct Progress {
  std::uint64_t points = 0;
  /// Left out for lack of data: cells without data, and points (entities) of XYZ, CSV, PLY, meshes
  /// and arrays with a coordinate that is NaN (in text also an empty field or NA). Infinite
  /// coordinates are errors.
  std::uint64_t nodata = 0;
  /// Attribute values that are empty or NA in a text file; they are NaN.
  std::uint64_t empty_values = 0;
  /// Points that their file marks as withheld (LAS). They are delivered, and counted in `points`.
  std::uint64_t withheld = 0;
  /// Points left out by Selection::where, region and resolution, whether they were read or not. Of
  /// rasters also cells that were not read, whatever they hold.
  std::uint64_t excluded = 0;
  /// Points of damaged parts that were left out (see SourceOptions::on_damage).
  std::uint64_t lost = 0;
  double fraction = 0.0;  ///< share of the work, 0 to 1; 0 if unknown
};

/// A stream of points, pulled block by block. Memory is bounded; a source never goes back to points
/// that it has delivered. Not thread-safe; `read_ahead` moves the work to a separate thread.
class PointSource {
 public:
  virtual ~PointSource() = default;

  [[nodiscard]] virtual const SourceInfo& info() const = 0;
  /// Replaces `block` by the next points and returns true; false at the end, with an empty block.
  /// Reuses the capacity of `block`. A block has at most SourceOptions::block_points points.
  /// Throws: Error for bad data, naming file, place, cause and remedy; Stopped.
  virtual bool next(PointBlock& block) = 0;
  [[nodiscard]] virtual Progress progress() const = 0;
  /// For rasters: sets two properties that callers can only determine after info(), the height /
  /// width of a cell on the ground, so that tiles are square there (the default is that of the
  /// transform), and SourceOptions::memory_bytes. Must be called before the first next(). Other
  /// sources ignore it.
  virtual void refine(double /*cell_aspect*/, std::uint64_t /*memory_bytes*/) {}
  /// Minimum memory of reading in bytes: for a raster, the window and its open file, whose need
  /// depends on its layout. 0 if only the blocks count.
  [[nodiscard]] virtual std::uint64_t reading_bytes() const { return 0; }
};

/// Selects a part of a source.
struct Selection {
  /// Points that do not meet this condition (see Where) are left out; empty: all points are kept.
  std::string where{};
  /// Names of the attributes to keep; nullopt: all. They keep the order of the file. Conditions may
  /// use all attributes. The columns of the shape of entities are always kept.
  std::optional<std::vector<std::string>> keep{};
  std::vector<std::string> drop{};  ///< names of attributes to leave out
  /// Points outside this box, in the source's CRS, are left out; its z are infinite if heights do
  /// not matter. Cells of rasters within a millionth of a cell of the box are inside. Of rasters,
  /// COPC and EPT only the necessary parts are read; a raster's columns and rows then count from
  /// its first cell near the box.
  std::optional<Box3> region{};
  /// If set, points in `region` are left out too if this returns false for their x, y. Called by
  /// the thread that reads.
  std::function<bool(const std::array<double, 2>& place)> covers{};
  /// If positive, only nodes of an octree down to the first depth whose spacing is at most this, in
  /// units of the CRS, are read. Formats without an octree are refused.
  double resolution = 0.0;
};

/// How the colours of a PNG encode heights in metres, with R, G, B from 0 to 255: mapbox as -10000
/// + (R * 65536 + G * 256 + B) / 10, terrarium as R * 256 + G + B / 256 - 32768.
enum class HeightsOfColour : std::uint8_t { none, mapbox, terrarium };

/// Called for each damaged part of a LAS, LAZ, COPC or EPT that is left out (a chunk, a node, the
/// missing end of a truncated file), with the number of points that it should have had, which is 0
/// for a part without points. Called by the thread that reads. Damage that affects all points is
/// still thrown.
using OnDamage = std::function<void(const Error& damage, std::uint64_t points)>;

/// The parts of a file that a source delivers. Entities of several corners are delivered as points:
/// the position is the first corner, the attributes are the other corners, of the coordinates'
/// type, bit for bit. After them come the properties of the entities.
enum class Entities : std::uint8_t {
  points,  ///< the points; of meshes and GeoJSON the vertices
  /// The triangles of a mesh (GLB, OBJ, OFF, PLY, STL), polygons cut into fans, in the order of the
  /// file: "x2", "y2", "z2", "x3", "y3", "z3". Scalar properties of the faces (PLY) keep their
  /// names and types. Attributes of vertices are left out.
  triangles,
  /// The segments of lines (GeoJSON, including rings of polygons), in the order of the file. Points
  /// are left out and counted as excluded. The attributes are:
  /// - "x2", "y2", "z2": the other end of the segment
  /// - "line": the number of the line, counted from 0 over all files
  /// - "part": the number of the segment in its line
  /// - "vertices": 2
  /// - "dimensions": 3 if the line has heights, otherwise 2
  /// - the numeric properties of the features, as f64, NaN if a feature has none. They are those
  /// that
  ///   occur in the first 2 MiB of any file. A property that occurs only later is an error, unless
  ///   Selection::keep or drop is set for it. An equal name gets a number.
  segments,
  /// Lines in pieces of at most kPolylineVertices vertices, where the last vertex of each piece is
  /// the first of the next: "x2" to "z4" and the other columns of segments. Missing corners of a
  /// piece are 0.
  polylines,
};
/// Maximum number of vertices of an entity of Entities::polylines.
inline constexpr std::size_t kPolylineVertices = 4;
/// Returns "points", "triangles", "segments" or "polylines".
std::string_view name_of(Entities entities);
/// Returns whether an attribute of that name belongs to the shape of the entities: a coordinate of
/// a corner, or the number of a line or piece. All others are properties.
bool is_shape_column(std::string_view name, Entities entities);
/// Returns the entities of that name; nullopt for other names.
std::optional<Entities> entities_named(std::string_view name);

/// Whether two descriptions mean the same CRS, however they are written.
using SameCrs = std::function<bool(const Crs&, const Crs&)>;

/// Options of any source.
struct SourceOptions {
  std::string format{};  ///< name of a format; empty: determined by content, then ending
  Entities entities = Entities::points;
  /// With Entities::triangles, a mesh without faces is an error; otherwise it delivers nothing.
  bool needs_faces = true;
  std::size_t block_points = 10000;        ///< maximum number of points per block
  std::uint64_t memory_bytes = 64u << 20;  ///< approximate memory limit of the source
  int band = 1;                            ///< of rasters, counted from 1
  HeightsOfColour heights_of_colour = HeightsOfColour::none;  ///< of PNG images in colour
  double cell = 0.0;         ///< if positive, side of the cells of rasters without georeferencing
  std::optional<Crs> crs{};  ///< overrides the files' CRS
  /// Called if the descriptions of several files differ; empty: different descriptions do not
  /// agree.
  SameCrs same_crs{};
  /// Makes any wait for a pipe, in open_source() and in next(), throw Stopped.
  std::stop_token stop{};
  /// If positive, blocks are read on a separate thread, at most this many ahead (see read_ahead()).
  /// The source's destructor does not wait for a pipe.
  std::size_t blocks_ahead = 0;
  unsigned threads = 1;  ///< decoding threads, for formats with independent parts (LAZ, EPT)
  OnDamage on_damage{};  ///< empty: damage is thrown
  Selection selection{};
};

/// Opens one file, or several as one source. Rasters form a mosaic (see open_mosaic()). Files of
/// other formats are read one after another, and must agree in CRS and in the attributes that the
/// selection keeps or its condition names.
///
/// A name may be:
/// - a file, or "-" for standard input (streaming formats only);
/// - a folder with an ept.json, which is that dataset;
/// - another folder: all files in it, recursively, whose names have an ending of a format (of
///   SourceOptions::format, if given), in the order of their paths;
/// - "@LIST": the names on the lines of the file LIST, relative to its folder; blank lines and
///   lines that begin with # are ignored;
/// - a pattern with *, ? or [...], if no file has that name: the files that match it. A component
///   ** of the path matches any number of folders.
///
/// Throws: Error, Stopped; std::invalid_argument for an unknown format, without names, and for
/// blocks of 0 points.
std::unique_ptr<PointSource> open_source(std::span<const std::string> names,
                                         const SourceOptions& options = {});

/// Returns the path of NAME.prj next to NAME.tif and the like, where ESRI's formats have their CRS;
/// empty if it does not exist.
[[nodiscard]] std::string prj_beside(const std::string& file);

/// Returns a source that reads `source` on a separate thread, at most `blocks` blocks ahead. An
/// Error thrown there is rethrown by the next() that would have delivered the block. The thread
/// starts at once; for a raster with the first next(), because refine() must come before it. If no
/// thread can be started, the caller's thread reads. reading: the stop source of `source`. A stop
/// is requested from it when one is requested from `stop`, and when the returned source is
/// destroyed, so that its destructor does not wait for a pipe.
std::unique_ptr<PointSource> read_ahead(
    std::unique_ptr<PointSource> source, std::size_t blocks = 8,
    const std::stop_source& reading = std::stop_source(std::nostopstate),
    const std::stop_token& stop = {});

/// A format in the registry and what its reader can do besides delivering points.
struct Format {
  std::string name;
  std::vector<std::string> endings;  ///< in lower case, with the dot: ".tif"
  bool streams = false;              ///< can be read from a pipe, front to back
  /// A format that does not stream can be read from a copy of the file, because neither the file's
  /// name nor files next to it matter.
  bool self_contained = false;
  /// Gets the first bytes of a file, up to 4096.
  bool (*recognise)(std::span<const std::byte> head) = nullptr;
  std::unique_ptr<PointSource> (*open)(std::span<const std::string> files,
                                       const SourceOptions& options) = nullptr;
  bool raster = false;          ///< has cells: SourceOptions::cell and band apply
  bool height_colours = false;  ///< SourceOptions::heights_of_colour applies
  bool octree = false;          ///< files may have an octree: Selection::resolution applies
  bool triangles = false;       ///< can be opened as Entities::triangles too
  bool lines = false;           ///< can be opened as Entities::segments and polylines too
};

/// Returns all readable formats.
std::span<const Format> formats();

}  // namespace terrace::stream
