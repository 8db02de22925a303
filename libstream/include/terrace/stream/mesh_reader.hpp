// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "terrace/stream/mesh_writer.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// A mesh file in memory.
struct MeshFile {
  SourceInfo info;      ///< of the vertices: their attributes; comments of the file
  PointBlock vertices;  ///< all of them
  std::vector<TriangleIndices> triangles;  ///< as they turn in the file; corners are vertices
};

/// Reads the triangles of a PLY (ASCII, both binaries), OBJ, OFF (text) or STL (text, binary) file:
/// polygons are cut into fans, the strips of "tristrips" into triangles. Vertices are as
/// open_source() gives them, but for those of an STL that are at one place, which are one; only a
/// PLY's have attributes. Formats are told by content, else ending, or by options.format.
///
/// Returns: nullopt if the file is none of them, or has no faces: it may then be a cloud of points.
/// Cost: memory for the mesh, and 1 MiB. Throws: Error on a damaged file, Stopped.
std::optional<MeshFile> read_mesh(const std::string& file, const SourceOptions& options = {});

}  // namespace terrace::stream
