// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/triangle_mesh.hpp"

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "base/file_marks.hpp"
#include "terrace/stream/mesh_writer.hpp"

namespace terrace::terrain {

void write_mesh(const std::string& path, const TriangleMesh& mesh,
                const stream::WriterOptions& options) {
  constexpr std::size_t kPiece = 65536;
  stream::Box3 bounds;
  for (const stream::Point3& p : mesh.positions) bounds.include(p);
  stream::MeshHeader header;
  header.vertices = mesh.positions.size();
  header.triangles = mesh.triangles.size();
  if (!mesh.levels.empty()) header.attributes = {"level"};
  header.comments = {kWriterMark};
  if (!bounds.empty()) header.bounds = bounds;
  const auto writer = stream::open_mesh_writer(path, header, options);
  std::vector<float> levels;
  const std::span vertices(mesh.positions);
  for (std::size_t at = 0; at < vertices.size(); at += kPiece) {
    const std::size_t count = std::min(kPiece, vertices.size() - at);
    if (!mesh.levels.empty()) {
      levels.assign(mesh.levels.begin() + static_cast<std::ptrdiff_t>(at),
                    mesh.levels.begin() + static_cast<std::ptrdiff_t>(at + count));
    }
    writer->add_vertices(vertices.subspan(at, count), levels);
  }
  writer->add_triangles(mesh.triangles);
  writer->finish();
}

}  // namespace terrace::terrain
