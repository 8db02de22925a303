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
  SourceInfo info;      ///< of the vertices: their attributes; comments of the file
  PointBlock vertices;  ///< all of them
  std::vector<TriangleIndices> triangles;  ///< oriented as in the file; corners are vertex indices
  std::uint64_t nodata = 0;  ///< triangles left out because a coordinate of a corner is NaN
};

/// Reads the triangles of a PLY (ASCII, both binaries), GLB, OBJ, OFF (text) or STL (text, binary)
/// file: polygons are cut into fans, strips into triangles; of a GLB those of all nodes of its
/// scene, each where its node puts it and turned from y up to z up. Vertices are as from
/// open_source(), except that coincident vertices of an STL are merged; only PLY vertices have
/// attributes. Triangles with a corner of which a coordinate is NaN are left out. Formats are
/// recognised by content, then by ending, or set by options.format.
///
/// Returns: nullopt if the file is none of these, or has no faces: it may then be a point cloud.
/// Cost: memory for the mesh, and 1 MiB. Throws: Error for a damaged file, Stopped.
std::optional<MeshFile> read_mesh(const std::string& file, const SourceOptions& options = {});

}  // namespace terrace::stream
