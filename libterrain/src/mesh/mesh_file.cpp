// SPDX-License-Identifier: Apache-2.0
#include "mesh/mesh_file.hpp"

#include <array>
#include <fstream>
#include <iterator>
#include <string_view>

#include "mesh/mesh_cursor.hpp"
#include "mesh/obj_mesh.hpp"
#include "mesh/ply_mesh.hpp"

namespace terrace::terrain {

std::optional<MeshFile> read_mesh_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, 4> magic{};
  file.read(magic.data(), magic.size());
  const bool ply = std::string_view(magic.data(), 3) == "ply";
  const bool obj_name = path.size() > 4 && path.ends_with(".obj");
  if (!file || (!ply && !obj_name)) return std::nullopt;
  file.seekg(0);
  const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  return ply ? read_ply_mesh(MeshCursor(path, bytes)) : read_obj_mesh(path, bytes);
}

}  // namespace terrace::terrain
