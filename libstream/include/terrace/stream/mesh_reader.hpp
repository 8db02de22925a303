// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "terrace/stream/mesh_writer.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// A mesh file in memory.
struct MeshFile {
  SourceInfo info;      ///< of the vertices, with their attributes and the file's comments
  PointBlock vertices;  ///< all of them
  std::vector<TriangleIndices> triangles;  ///< oriented as in the file
  std::uint64_t nodata = 0;  ///< triangles left out because a corner has a NaN coordinate
};

/// Reads the triangles of a PLY (ASCII, both binaries), GLB, OBJ, OFF (text) or STL (text, binary)
/// file. Polygons are cut into fans, strips into triangles. A GLB gives the triangles of all nodes
/// of its scene, placed by their nodes and turned from y up to z up. Vertices are as from
/// open_source(), except that coincident vertices of an STL are merged; only PLY vertices have
/// attributes. Triangles with a NaN coordinate are left out. The format is options.format, or is
/// recognised by content, then by ending.
///
/// Returns nullopt if the file has none of these formats, or no faces: it may then be a point
/// cloud. Memory: the mesh and 1 MiB. Throws: Error for a damaged file, Stopped.
std::optional<MeshFile> read_mesh(const std::string& file, const SourceOptions& options = {});

}  // namespace terrace::stream
