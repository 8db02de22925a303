// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// Units of coordinates, as in Channel::unit; empty if unknown.
struct CoordinateUnits {
  std::string horizontal{};  ///< of x and y
  std::string height{};
};

/// The header of a point file.
struct PointHeader {
  /// Columns after the coordinates, as in PointBlock::payload. Types are kept if the format has
  /// them. A column with a scale other than 1 or an offset other than 0 is written as real values
  /// (float64).
  std::vector<Channel> attributes{};
  std::vector<std::string> comments{};  ///< written if the format has comments (PLY)
  /// Returns the CRS of the coordinates. Formats that store one (LAS) write its WKT, or its GeoKeys
  /// if it has no WKT. Other formats do not call it, because finding the WKT may mean searching a
  /// database. Empty if the CRS is unknown.
  std::function<Crs()> crs{};
  /// Returns the units of the coordinates. Formats that record them apart from the CRS (CSV) call
  /// it.
  std::function<CoordinateUnits()> units{};
  /// The lattice of the coordinates, if they are on one. Text gets its decimals (849393.95, not
  /// 849393.9500000001), and formats with integer coordinates (LAS) use it. Without a lattice,
  /// these use a power of ten that suits the first points and the bounds.
  std::optional<Lattice> lattice{};
  std::optional<Box3> bounds{};  ///< bounding box of the points, if known beforehand
};

/// Converts stored coordinates to coordinates of the CRS, as world_point() does. Attributes stay
/// unchanged.
void to_world(const Placement& placement, PointBlock& block);

/// Writes a stream of points to a file, which appears under its name, complete and synced, with
/// finish(); a writer destroyed before that leaves nothing. Memory is bounded; the same points give
/// the same bytes.
class PointWriter {
 public:
  virtual ~PointWriter() = default;

  /// Points on their way from encode() to append().
  struct Encoded {
    virtual ~Encoded() = default;
  };
  using EncodedPtr = std::unique_ptr<Encoded>;

  /// The expensive half of appending points. May be called by several threads at once, also while
  /// another appends. `block.positions` are coordinates of the CRS, written exactly, as doubles;
  /// `block.payload` has records of the header's columns.
  [[nodiscard]] virtual EncodedPtr encode(const PointBlock& block) const = 0;
  /// The ordered half: one thread at a time. Takes a result of this writer's encode(). Throws:
  /// Error if writing fails, for example because the disk is full, and for points that the format
  /// cannot hold.
  virtual void append(EncodedPtr points) = 0;
  /// Both halves in one call.
  void append(const PointBlock& block) { append(encode(block)); }
  /// Publishes the file. Nothing may be appended afterwards.
  virtual void finish() = 0;
  /// Points appended so far.
  [[nodiscard]] virtual std::uint64_t points() const = 0;
  /// True if the file can state the CRS and the units of coordinates.
  [[nodiscard]] virtual bool records_units() const { return false; }
  /// True if the file names the unit that PointHeader::units returns for heights.
  [[nodiscard]] virtual bool names_height_unit() const { return false; }
  /// Maximum distance by which a coordinate was moved to fit the format's integers; 0 if none was
  /// moved by more than the rounding of doubles.
  [[nodiscard]] virtual double rounding() const { return 0.0; }
  /// Minimum memory of writing in bytes, whatever WriterOptions::memory_bytes; 0 if only the blocks
  /// count.
  [[nodiscard]] virtual std::uint64_t writing_bytes() const { return 0; }
};

/// Options of writers of points and meshes.
struct WriterOptions {
  /// Name of a format; empty: determined by the file's ending. Meshes: "ply", "ply-ascii", "obj",
  /// "glb". Points:
  /// - "xyz": x y z and attributes, separated by blanks
  /// - "csv": with a header line
  /// - "ply" (binary, little-endian), "ply-ascii"
  /// - "las", "laz": LAS 1.4
  /// - "copc": ".copc.laz", written in finish() through a temporary file next to it
  std::string format{};
  Naming replace{};  ///< whether an existing file is replaced; otherwise it is an Error
  /// Makes a wait for the reader of standard output, and PointWriter::finish() of "copc", throw
  /// Stopped.
  std::stop_token stop{};
  /// Memory limit of "laz" and "copc"; the bytes of the file do not depend on it. COPC needs at
  /// least PointWriter::writing_bytes(), some 40 MiB; more than 192 MiB only help if many points
  /// are at one place. LAZ needs at least twice a chunk of 50,000 records, and as much for each
  /// thread.
  std::uint64_t memory_bytes = 128u << 20;
  unsigned threads = 1;  ///< encoding threads of "laz" and "copc"; the bytes are the same
};

/// Opens a writer for `path`; "-" is standard output, for "xyz" (the default there) and "csv".
/// Numbers in text are the shortest that read back as the same value.
/// Throws: std::invalid_argument for an unknown format, naming the known ones; Error if the file
/// cannot be created, or if memory_bytes is too little for LAZ.
std::unique_ptr<PointWriter> open_point_writer(const std::string& path, const PointHeader& header,
                                               const WriterOptions& options = {});

}  // namespace terrace::stream
