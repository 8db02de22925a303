// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "terrace/stream/mesh_writer.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {

/// A format that can be written, as a row of a table.
struct WriterFormat {
  std::string_view name;
  std::string_view ending;  ///< empty: by name only
  std::string_view second_ending;
  bool streams;  ///< can be written to standard output
};

/// Returns the number of the row for `path`: by options.format, else by ending; for "-" the first
/// that streams. Throws: Error that lists the formats of the table.
std::size_t choose_format(std::span<const WriterFormat> table, const std::string& path,
                          const WriterOptions& options);

std::unique_ptr<PointWriter> open_xyz_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options);
std::unique_ptr<PointWriter> open_csv_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options);
std::unique_ptr<PointWriter> open_ply_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options);
std::unique_ptr<PointWriter> open_ply_ascii_writer(const std::string& path,
                                                   const PointHeader& header,
                                                   const WriterOptions& options);
std::unique_ptr<PointWriter> open_las_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options);
std::unique_ptr<PointWriter> open_copc_writer(const std::string& path, const PointHeader& header,
                                              const WriterOptions& options);
/// Like open_copc_writer(), with `page_nodes` nodes per page: see write_copc_hierarchy().
std::unique_ptr<PointWriter> open_paged_copc_writer(const std::string& path,
                                                    const PointHeader& header,
                                                    const WriterOptions& options,
                                                    std::size_t page_nodes);
std::unique_ptr<PointWriter> open_laz_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options);

std::unique_ptr<MeshWriter> open_ply_mesh_writer(const std::string& path, const MeshHeader& header,
                                                 const WriterOptions& options);
std::unique_ptr<MeshWriter> open_ply_ascii_mesh_writer(const std::string& path,
                                                       const MeshHeader& header,
                                                       const WriterOptions& options);
std::unique_ptr<MeshWriter> open_obj_writer(const std::string& path, const MeshHeader& header,
                                            const WriterOptions& options);
std::unique_ptr<MeshWriter> open_glb_writer(const std::string& path, const MeshHeader& header,
                                            const WriterOptions& options);

/// Returns the local origin of a GLB file whose vertices are in `bounds`.
Point3 glb_origin(const Box3& bounds);
/// Returns the value that a GLB file stores for a coordinate whose unit is `metres` long. Not
/// inline: where GCC 12 vectorises it and widens the result again immediately, it drops the
/// rounding.
float glb_coordinate(double coordinate, double origin, double metres);

/// Returns the index of nx if a mesh has normals: nx, ny and nz follow one another.
std::optional<std::size_t> normals_in(std::span<const std::string> attributes);

/// Asserts that a mesh writer's caller adds what its header promises.
class MeshCounts {
 public:
  explicit MeshCounts(const MeshHeader& header)
      : vertices_(header.vertices),
        triangles_(header.triangles),
        attributes_(header.attributes.size()) {}

  void add_vertices(std::span<const Point3> positions, std::span<const float> attributes) {
    assert(positions.size() <= vertices_left() && triangles_seen_ == 0);
    assert(attributes.size() == positions.size() * attributes_);
    (void)attributes;
    vertices_seen_ += positions.size();
  }
  void add_triangles(std::span<const TriangleIndices> triangles) {
    assert(vertices_left() == 0 && triangles.size() <= triangles_ - triangles_seen_);
    triangles_seen_ += triangles.size();
  }
  /// True if all promised vertices and triangles have been added.
  [[nodiscard]] bool complete() const {
    return vertices_seen_ == vertices_ && triangles_seen_ == triangles_;
  }
  [[nodiscard]] std::uint64_t vertices_left() const { return vertices_ - vertices_seen_; }

 private:
  std::uint64_t vertices_, triangles_;
  std::size_t attributes_;
  std::uint64_t vertices_seen_ = 0, triangles_seen_ = 0;
};

}  // namespace terrace::stream
