// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <terrace/stream/point.hpp>
#include <terrace/stream/point_writer.hpp>

namespace terrace::terrain {

using Rgb = std::array<std::uint8_t, 3>;

/// Vertices with what is known of them, and triangles between them: none for a cloud of points.
/// The optional columns are empty or as long as `positions`.
struct TriangleMesh {
  std::vector<stream::Point3> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< either orientation
  std::vector<std::uint8_t> levels;                     ///< of a store
  std::vector<std::int32_t> classes;                    ///< class or cluster
  std::vector<std::uint32_t> representatives;  ///< of the clusters: vertex numbers, any length
  std::vector<Rgb> colours;
  std::vector<std::array<float, 3>> normals;  ///< unit length
  /// For a cloud that is coarse somewhere: how many levels are left out around each point.
  std::vector<std::uint8_t> left_out;
};

/// Writes a mesh, with its levels where it has any; "-" is standard output. The file is whole or
/// not there. Throws: stream::Error, stream::Stopped.
void write_mesh(const std::string& path, const TriangleMesh& mesh,
                const stream::WriterOptions& options = {});

}  // namespace terrace::terrain
