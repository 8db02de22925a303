// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "mesh/mesh_file.hpp"

namespace terrace::terrain {

/// An OBJ file as read_mesh_file() has it; nothing if it has no vertices or faces.
std::optional<MeshFile> read_obj_mesh(const std::string& name, std::string_view bytes);

}  // namespace terrace::terrain
