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

/// Reads the triangles of a PLY file (ASCII, both binaries) or an OBJ: polygons are cut into fans,
/// the strips of "tristrips" into triangles. Vertices are as open_source() gives them; an OBJ's
/// have no attributes. A PLY is told by its content, an OBJ by its ending, either by
/// options.format.
///
/// Returns: nullopt if the file is neither, or has no faces: it may then be a cloud of points.
/// Cost: memory for the mesh, and 1 MiB. Throws: Error on a damaged file, Stopped.
std::optional<MeshFile> read_mesh(const std::string& file, const SourceOptions& options = {});

}  // namespace terrace::stream
