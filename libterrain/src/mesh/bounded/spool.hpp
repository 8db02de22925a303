// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <terrace/stream/atomic_file.hpp>
#include <terrace/stream/mesh_writer.hpp>
#include <terrace/stream/point.hpp>

namespace terrace::terrain {

/// Keeps a mesh that arrives in pieces on disk, next to the final file, until its counts are known
/// and the file can be written. The temporary files are removed with the object.
class MeshSpool {
 public:
  /// path: the mesh file; for "-" the pieces are in the folder for temporary files.
  explicit MeshSpool(const std::string& path);

  [[nodiscard]] std::uint64_t vertices() const { return vertices_; }
  [[nodiscard]] std::uint64_t triangles() const { return triangles_; }

  /// All throw stream::Error, for example if the disk is full. There must be fewer than 2^32
  /// vertices.
  void add_vertices(std::span<const stream::Point3> positions);
  void add_triangles(std::span<const stream::TriangleIndices> triangles);

  /// Writes the file. bounds, frame: see stream::MeshHeader.
  void write(const std::string& path, const stream::WriterOptions& options,
             const stream::Box3& bounds, const std::optional<stream::MeshFrame>& frame);

 private:
  stream::AtomicFile vertex_file_, triangle_file_;
  std::uint64_t vertices_ = 0, triangles_ = 0;
};

}  // namespace terrace::terrain
