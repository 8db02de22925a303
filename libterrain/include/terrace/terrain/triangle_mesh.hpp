// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <terrace/stream/mesh_reader.hpp>
#include <terrace/stream/point.hpp>
#include <terrace/stream/point_writer.hpp>
#include <terrace/stream/source.hpp>

namespace terrace::terrain {

/// Vertices with what is known of them, and triangles between them: none for a cloud of points.
/// The optional columns are empty or as long as `positions`.
struct TriangleMesh {
  std::vector<stream::Point3> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< either orientation
  std::vector<std::uint8_t> levels;                     ///< of a store
  std::vector<std::int32_t> classes;                    ///< class or cluster
  std::vector<std::uint32_t> representatives;  ///< of the clusters: vertex numbers, any length
  /// Red, green and blue, 65,535 at most. Colours of 8 bits in fields of 16, which are common in
  /// clouds, are not scaled.
  std::vector<std::array<std::uint16_t, 3>> colours;
  std::vector<std::array<float, 3>> normals;  ///< unit length
  /// For a cloud that is coarse somewhere: how many levels are left out around each point.
  std::vector<std::uint8_t> left_out;
};

/// Appends points, in stored coordinates, with those of their attributes that a mesh has a column
/// for, by their usual names: level; class, classification or cluster; red, green, blue (of 16 bits
/// too); nx, ny, nz; representative (the number of the point that represents a point's cluster).
void append_points(TriangleMesh& mesh, const stream::Schema& schema,
                   const stream::PointBlock& points);
/// The mesh of a file (see stream::read_mesh()).
[[nodiscard]] TriangleMesh triangle_mesh_of(stream::MeshFile file);

/// Writes a mesh, with its levels where it has any; "-" is standard output. The file is whole or
/// not there. Throws: stream::Error, stream::Stopped.
void write_mesh(const std::string& path, const TriangleMesh& mesh,
                const stream::WriterOptions& options = {});

}  // namespace terrace::terrain
