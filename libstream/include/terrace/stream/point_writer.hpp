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

/// The header of a file of points.
struct PointHeader {
  /// Columns after the coordinates, as in PointBlock::payload. Types are kept if the format has
  /// types. A column whose scale is not 1 or whose offset is not 0 is written as real values
  /// (float64).
  std::vector<Channel> attributes{};
  std::vector<std::string> comments{};  ///< written if the format has comments (PLY)
  /// The CRS of the coordinates, of which formats that have a place for it (LAS) write the WKT, or
  /// GeoKeys where there is none. The others do not ask: WKT is mostly searched for in a database.
  /// Null if the CRS is unknown.
  std::function<Crs()> crs{};
  /// The lattice on which coordinates lie: text gets its decimals (849393.95, not
  /// 849393.9500000001), and formats with integer coordinates (LAS) use it. Without a lattice these
  /// take a power of ten that suits the first points and the bounds.
  std::optional<Lattice> lattice{};
  std::optional<Box3> bounds{};  ///< bounding box of the points, if known beforehand
};

/// Converts stored coordinates to the coordinates of the CRS: WorldTransform, then scale and offset
/// of the third coordinate. Attributes stay unchanged.
void to_world(const Placement& placement, PointBlock& block);

/// Writes a stream of points to a file, which appears under its name, complete and synced, with
/// finish(); a writer destroyed before that leaves nothing. Bounded memory; the same points give
/// the same bytes.
class PointWriter {
 public:
  virtual ~PointWriter() = default;

  /// Points on their way from encode() to append().
  struct Encoded {
    virtual ~Encoded() = default;
  };
  using EncodedPtr = std::unique_ptr<Encoded>;

  /// The expensive half of appending points: may be called by several threads at once, also while
  /// one appends. `block.positions` are world coordinates and written exactly, as doubles;
  /// `block.payload` has records of the header's columns.
  [[nodiscard]] virtual EncodedPtr encode(const PointBlock& block) const = 0;
  /// The ordered half: one thread at a time. Takes what encode() of this writer gave. Throws: Error
  /// if writing fails, for example because the disk is full, and for points that the format cannot
  /// hold.
  virtual void append(EncodedPtr points) = 0;
  /// Both, in one thread.
  void append(const PointBlock& block) { append(encode(block)); }
  /// Publishes the file. Nothing may be appended afterwards.
  virtual void finish() = 0;
  /// Points appended so far.
  [[nodiscard]] virtual std::uint64_t points() const = 0;
  /// Whether the file has a place for the CRS and the units of coordinates.
  [[nodiscard]] virtual bool records_units() const { return false; }
  /// How far a coordinate was moved to fit the integers of the format, at most; 0 where none was
  /// moved by more than doubles lose on the way.
  [[nodiscard]] virtual double rounding() const { return 0.0; }
  /// What writing takes at least, in bytes, whatever WriterOptions::memory_bytes; 0 where nothing
  /// but the blocks counts.
  [[nodiscard]] virtual std::uint64_t writing_bytes() const { return 0; }
};

struct WriterOptions {
  /// Name of a format; empty: by the file's ending. Points: "xyz" (x y z and attributes, separated
  /// by blanks), "csv" (with a header line), "ply" (binary, little-endian), "ply-ascii", "las" and
  /// "laz" (LAS 1.4), and "copc" (".copc.laz"; written in finish(), through a temporary file next
  /// to it). Meshes: "ply", "ply-ascii", "obj", "glb".
  std::string format{};
  Naming replace{};  ///< of an existing file, which is refused unless given
  /// Ends a wait for the reader of standard output, and PointWriter::finish() of "copc", with
  /// Stopped.
  std::stop_token stop{};
  /// What "laz" and "copc" may hold. COPC takes PointWriter::writing_bytes() at least, some 40 MiB;
  /// more than 192 MiB serve many points at one place alone. LAZ takes twice a chunk of 50,000
  /// records at least, and as much for each thread. The bytes of the file do not depend on it.
  std::uint64_t memory_bytes = 128u << 20;
  unsigned threads = 1;  ///< that encode at once, of "laz" and "copc"; the bytes are the same
};

/// A writer for `path`; "-" is standard output, for "xyz" (also if no format is named) and "csv".
/// Numbers in text are the shortest that read back as the same value.
/// Throws: std::invalid_argument if the format is unknown (names the known ones); Error if the file
/// cannot be created, or if memory_bytes is too little for LAZ.
std::unique_ptr<PointWriter> open_point_writer(const std::string& path, const PointHeader& header,
                                               const WriterOptions& options = {});

}  // namespace terrace::stream
