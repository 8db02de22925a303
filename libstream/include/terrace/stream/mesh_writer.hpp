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

/// How coordinates are converted to metres for a format whose unit is the metre (GLB).
struct MeshFrame {
  Point3 metres{1, 1, 1};  ///< metres per unit of x, y and z; positive
  /// True: x and y become metres from the middle of the bounds; for longitudes and latitudes, which
  /// cannot be absolute positions in metres. False: positions stay absolute, in metres.
  bool local = false;
  std::string crs{};  ///< name of the coordinates' CRS, written to the file
};

/// The header of a mesh file. The mesh must have exactly the declared counts.
struct MeshHeader {
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  /// Names of float values per vertex ("level", ...). "nx", "ny" and "nz", in this order, are unit
  /// normals.
  std::vector<std::string> attributes{};
  std::vector<std::string> comments{};  ///< written if the format has comments (PLY, OBJ)
  /// Bounding box of all vertices, if known: GLB puts its local origin at the centre. Otherwise the
  /// first vertex is the origin.
  std::optional<Box3> bounds{};
  /// GLB only; without a frame it has the coordinates unchanged.
  std::optional<MeshFrame> frame{};
};

/// Vertex indices of a triangle, counter-clockwise seen from outside (for terrain, from above).
using TriangleIndices = std::array<std::uint32_t, 3>;

/// Writes a triangle mesh to a file, which appears under its name, complete and synced, with
/// finish(); a writer destroyed before that leaves nothing. All vertices must be added before the
/// triangles, both in pieces of any size. Memory is bounded; the same mesh gives the same bytes.
///
/// PLY: double coordinates, float attributes, binary little-endian or ASCII; exact.
/// OBJ: coordinates as the shortest decimals that read back as the same double. Normals become "vn"
/// lines; other attributes cannot be represented and are dropped.
/// GLB (binary glTF 2.0): positions are float32 relative to a local origin, which the node's
/// translation holds in double precision, so each coordinate is off by at most 2^-24 of its
/// distance from the origin. glTF's y axis points up: (x, y, z) with z up is stored as (x, z, -y).
/// With a frame, coordinates are converted to metres, and asset.extras has what is needed to
/// convert a vertex X, Y, Z of the scene back: x = origin[0] + X / metres_per_unit[0], y =
/// origin[1] - Z / metres_per_unit[1], z = Y / metres_per_unit[2].
/// Attributes become vertex attributes, "level" as "_LEVEL". Normals become "NORMAL"; one of length
/// zero points up, because glTF requires unit length. Maximum size: 4 GiB. A mesh without
/// triangles is written as a point cloud, one without vertices as an empty scene.
class MeshWriter {
 public:
  virtual ~MeshWriter() = default;

  /// Appends vertices with finite coordinates, and header.attributes.size() values per vertex.
  virtual void add_vertices(std::span<const Point3> positions,
                            std::span<const float> attributes = {}) = 0;
  /// Appends triangles, after all vertices.
  virtual void add_triangles(std::span<const TriangleIndices> triangles) = 0;
  /// Publishes the file. Both counts must be as declared.
  virtual void finish() = 0;
};

/// Opens a writer for `path`. The format is WriterOptions::format, or follows from the ending
/// (.ply, .obj, .glb). "-" is standard output, for "obj" (the default there) and "ply-ascii".
/// Throws: std::invalid_argument for an unknown format, naming the known ones; Error if the format
/// cannot hold a mesh of this size, or if the file cannot be created.
std::unique_ptr<MeshWriter> open_mesh_writer(const std::string& path, const MeshHeader& header,
                                             const WriterOptions& options = {});

/// Returns the name of the format that open_mesh_writer() would write: "ply", "glb". Throws as
/// open_mesh_writer() does.
std::string mesh_format(const std::string& path, const WriterOptions& options = {});

/// The rounding of positions by a mesh file.
class MeshRounding {
 public:
  /// For vertices that are used as they are, not written.
  MeshRounding() = default;
  /// For the file that open_mesh_writer() writes with this path and these options, and `bounds` and
  /// `frame` in its header. Throws: std::invalid_argument for an unknown format.
  MeshRounding(const std::string& path, const Box3& bounds, const WriterOptions& options = {},
               const std::optional<MeshFrame>& frame = {});

  /// Returns the position that a reader of the file gets for `p`, in the coordinates of `p`.
  [[nodiscard]] Point3 operator()(const Point3& p) const;
  /// The maximum change of a coordinate of a point in `bounds`, per axis: 0 if the format is exact.
  [[nodiscard]] const Point3& largest() const { return largest_; }

 private:
  std::optional<Point3> origin_;  ///< positions are float32 relative to it; nullopt: exact
  Point3 metres_{1, 1, 1};
  Point3 largest_{};
};

}  // namespace terrace::stream
