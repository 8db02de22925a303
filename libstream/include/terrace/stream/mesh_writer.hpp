// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "terrace/stream/point.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {

/// What a mesh file says before its first vertex. The counts are promises.
struct MeshHeader {
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  std::vector<std::string> attributes{};  ///< names of float values per vertex ("level", ...)
  std::vector<std::string> comments{};    ///< written where the format has comments (PLY, OBJ)
  /// Box of all vertices, if known: GLB puts its local origin at the centre. Else the first vertex
  /// is the origin.
  std::optional<Box3> bounds{};
};

/// Vertex numbers of a triangle, counter-clockwise seen from outside (terrain: from above).
using TriangleIndices = std::array<std::uint32_t, 3>;

/// Writes a triangle mesh to a file, which appears under its name, whole and synced, with finish();
/// a writer destroyed before leaves nothing. First all vertices, then all triangles, each in pieces
/// of any size. Bounded memory; same mesh, same bytes.
///
/// PLY: double coordinates, float attributes, binary little-endian or ASCII; exact.
/// OBJ: coordinates as the shortest decimals that read back as the same double; attributes have no
///   place in it and are left out.
/// GLB (binary glTF 2.0): positions are float32 about a local origin, which the node's translation
///   carries in double precision; so a vertex is off by at most 2^-24 of its distance from the
///   origin per axis. glTF's y axis points up: (x, y, z) with z up is stored as (x, z, -y).
///   Attributes become vertex attributes, "level" as "_LEVEL". At most 4 GiB. Without triangles it
///   is a cloud of points, without vertices an empty scene.
class MeshWriter {
 public:
  virtual ~MeshWriter() = default;

  /// Appends vertices: finite coordinates, and header.attributes.size() values for each vertex.
  virtual void add_vertices(std::span<const Point3> positions,
                            std::span<const float> attributes = {}) = 0;
  /// Appends triangles, once all vertices are there.
  virtual void add_triangles(std::span<const TriangleIndices> triangles) = 0;
  /// Publishes the file. Both counts must be as promised.
  virtual void finish() = 0;
};

/// A writer for `path`, by WriterOptions::format, else by ending (.ply, .obj, .glb). "-" is
/// standard output, for "obj" (also if no format is named) and "ply-ascii". Throws: Error if the
/// format is unknown (names the known ones), cannot hold so large a mesh, or the file cannot be
/// created.
std::unique_ptr<MeshWriter> open_mesh_writer(const std::string& path, const MeshHeader& header,
                                             const WriterOptions& options = {});

/// What a mesh file does to positions.
class MeshRounding {
 public:
  /// For the file that open_mesh_writer() writes with the same path and options, and `bounds` in
  /// its header. Throws: Error as that does for a format that is not known.
  MeshRounding(const std::string& path, const Box3& bounds, const WriterOptions& options = {});

  /// The position that a reader of the file gets back for `p`.
  [[nodiscard]] Point3 operator()(const Point3& p) const;
  /// By how much a coordinate of a point in `bounds` may change, per axis: 0 where the format is
  /// exact.
  [[nodiscard]] const Point3& largest() const { return largest_; }

 private:
  std::optional<Point3> origin_;  ///< float32 about it; else exact
  Point3 largest_{};
};

}  // namespace terrace::stream
