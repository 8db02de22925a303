// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "mesh/scene.hpp"

namespace terrace::terrain {

struct MeshFile {
  TriangleMesh mesh;
  std::string comments;  ///< of the header, one a line: a CRS may be named there
};

/// Reads the triangles of a PLY (ASCII, both binaries) or OBJ file: polygons are cut into fans, of
/// "tristrips" the strips; vertex properties level, class, cluster, red, green, blue, nx, ny, nz
/// are kept. Told by content. Nothing if the file is no PLY or OBJ, or has no faces: it may then be
/// a cloud of points. The whole file is held in memory. Throws: stream::Error on a file that is
/// damaged.
std::optional<MeshFile> read_mesh_file(const std::string& path);

}  // namespace terrace::terrain
