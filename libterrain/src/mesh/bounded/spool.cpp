// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/spool.hpp"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <vector>

#include <terrace/stream/error.hpp>

#include "base/file_marks.hpp"

namespace terrace::terrain {
namespace {

constexpr std::size_t kSpoolPiece = 65536;  // vertices or triangles at a time

/// The path from which the names of the temporary files are derived.
std::filesystem::path spool_name(const std::string& path) {
  return path != "-" ? std::filesystem::path(path)
                     : std::filesystem::temp_directory_path() / "terrace-mesh";
}

// Calls take(span of T) for the whole file, piece by piece.
template <class T, class Take>
void read_back(stream::AtomicFile& file, std::uint64_t count, const std::stop_token& stop,
               const Take& take) {
  std::vector<T> piece;
  for (std::uint64_t at = 0; at < count; at += kSpoolPiece) {
    if (stop.stop_requested()) throw stream::Stopped();
    piece.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kSpoolPiece, count - at)));
    const auto bytes = std::as_writable_bytes(std::span(piece));
    if (file.read_at(at * sizeof(T), bytes) != bytes.size()) {
      throw stream::Error(file.target().string(), "a temporary file was truncated while in use")
          .at_byte(at * sizeof(T))
          .remedy("check the disk and run again");
    }
    take(std::span<const T>(piece));
  }
}

stream::Naming spool_naming(const std::string& path) {
  stream::Naming naming(true);
  if (path == "-") naming.shown = "standard output";
  return naming;
}

}  // namespace

MeshSpool::MeshSpool(const std::string& path)
    : vertex_file_(spool_name(path), spool_naming(path)),
      triangle_file_(spool_name(path), spool_naming(path)) {}

void MeshSpool::add_vertices(std::span<const stream::Point3> positions) {
  if (positions.size() > std::numeric_limits<std::uint32_t>::max() - vertices_) {
    throw stream::Error(vertex_file_.target().string(),
                        "the mesh has more than 4,294,967,295 vertices")
        .remedy("mesh smaller regions, or allow a larger error");
  }
  vertex_file_.write(std::as_bytes(positions));
  vertices_ += positions.size();
}

void MeshSpool::add_triangles(std::span<const stream::TriangleIndices> triangles) {
  triangle_file_.write(std::as_bytes(triangles));
  triangles_ += triangles.size();
}

void MeshSpool::write(const std::string& path, const stream::WriterOptions& options,
                      const stream::Box3& bounds, const std::optional<stream::MeshFrame>& frame) {
  stream::MeshHeader header;
  header.vertices = vertices_;
  header.triangles = triangles_;
  header.comments = {kWriterMark};
  if (!bounds.empty()) header.bounds = bounds;
  header.frame = frame;
  const auto writer = stream::open_mesh_writer(path, header, options);
  read_back<stream::Point3>(vertex_file_, vertices_, options.stop,
                            [&](std::span<const stream::Point3> p) { writer->add_vertices(p); });
  read_back<stream::TriangleIndices>(
      triangle_file_, triangles_, options.stop,
      [&](std::span<const stream::TriangleIndices> t) { writer->add_triangles(t); });
  writer->finish();
}

}  // namespace terrace::terrain
