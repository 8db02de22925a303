// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "mesh/mesh_cursor.hpp"
#include "mesh/mesh_file.hpp"

namespace terrace::terrain {

/// A PLY file as read_mesh_file() has it; nothing if it has no faces.
std::optional<MeshFile> read_ply_mesh(MeshCursor in);

}  // namespace terrace::terrain
