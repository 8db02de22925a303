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

/// How coordinates become the metres of a format that has no other unit (GLB).
struct MeshFrame {
  Point3 metres{1, 1, 1};  ///< in a unit of x, y and z; positive
  /// x and y become metres from the middle of the bounds, for longitudes and latitudes have no
  /// place in metres. Otherwise the file keeps the place: x, y and z, in metres.
  bool local = false;
  std::string crs{};  ///< of the coordinates: named in the file
};

/// The header of a mesh file. The counts must be kept.
struct MeshHeader {
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  std::vector<std::string> attributes{};  ///< names of float values per vertex ("level", ...)
  std::vector<std::string> comments{};    ///< written if the format has comments (PLY, OBJ)
  /// Bounding box of all vertices, if known: GLB puts its local origin at the centre. Otherwise the
  /// first vertex is the origin.
  std::optional<Box3> bounds{};
  /// Without one GLB has the coordinates as they are. The other formats do not use it.
  std::optional<MeshFrame> frame{};
};

/// Vertex indices of a triangle, counter-clockwise seen from outside (terrain: from above).
using TriangleIndices = std::array<std::uint32_t, 3>;

/// Writes a triangle mesh to a file, which appears under its name, complete and synced, with
/// finish(); a writer destroyed before that leaves nothing. First all vertices, then all triangles,
/// each in pieces of any size. Bounded memory; the same mesh gives the same bytes.
///
/// PLY: double coordinates, float attributes, binary little-endian or ASCII; exact.
/// OBJ: coordinates as the shortest decimals that read back as the same double; attributes cannot
/// be represented and are dropped.
/// GLB (binary glTF 2.0): positions are float32 relative to a local origin, which the node's
/// translation holds in double precision; so a vertex is off by at most 2^-24 of its distance from
/// the origin per axis. glTF's y axis points up: (x, y, z) with z up is stored as (x, z, -y).
/// With a frame coordinates become metres on the way, and asset.extras says how they are got back:
/// of a vertex at X, Y, Z in the scene x = origin[0] + X / metres_per_unit[0],
/// y = origin[1] - Z / metres_per_unit[1] and z = Y / metres_per_unit[2].
/// Attributes become vertex attributes, "level" as "_LEVEL". At most 4 GiB. Without triangles it is
/// a point cloud, without vertices an empty scene.
class MeshWriter {
 public:
  virtual ~MeshWriter() = default;

  /// Appends vertices: finite coordinates, and header.attributes.size() values per vertex.
  virtual void add_vertices(std::span<const Point3> positions,
                            std::span<const float> attributes = {}) = 0;
  /// Appends triangles, after all vertices.
  virtual void add_triangles(std::span<const TriangleIndices> triangles) = 0;
  /// Publishes the file. Both counts must be as declared.
  virtual void finish() = 0;
};

/// A writer for `path`, by WriterOptions::format, otherwise by ending (.ply, .obj, .glb). "-" is
/// standard output, for "obj" (also if no format is given) and "ply-ascii". Throws:
/// std::invalid_argument if the format is unknown (names the known ones); Error if it cannot hold
/// such a large mesh, or if the file cannot be created.
std::unique_ptr<MeshWriter> open_mesh_writer(const std::string& path, const MeshHeader& header,
                                             const WriterOptions& options = {});

/// The name of the format that open_mesh_writer() would write: "ply", "glb". Throws as it does.
std::string mesh_format(const std::string& path, const WriterOptions& options = {});

/// The rounding of positions by a mesh file.
class MeshRounding {
 public:
  /// For the file that open_mesh_writer() writes with the same path and options, and `bounds` and
  /// `frame` in its header. Throws: std::invalid_argument for an unknown format, as
  /// open_mesh_writer() does.
  MeshRounding(const std::string& path, const Box3& bounds, const WriterOptions& options = {},
               const std::optional<MeshFrame>& frame = {});

  /// The position that a reader of the file gets back for `p`, in the coordinates of `p`.
  [[nodiscard]] Point3 operator()(const Point3& p) const;
  /// The maximum change of a coordinate of a point in `bounds`, per axis: 0 if the format is exact.
  [[nodiscard]] const Point3& largest() const { return largest_; }

 private:
  std::optional<Point3> origin_;  ///< float32 relative to it; nullopt: exact
  Point3 metres_{1, 1, 1};
  Point3 largest_{};
};

}  // namespace terrace::stream
