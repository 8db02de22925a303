// SPDX-License-Identifier: GPL-3.0-or-later
// Mesh files, PLY and OBJ: refused, or triangles of vertices that are there, with as many of each
// property as there are vertices.
#include "fuzz_target.hpp"
#include "mesh/mesh_file.hpp"
#include "mesh/obj_mesh.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::tools {

using namespace terrain;

bool accepts(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = text_of(data, size);
  std::optional<MeshFile> file;
  try {
    if (text.starts_with("ply")) {
      const MemoryFile on_disk(text);
      file = read_mesh_file(on_disk.name());
    } else {
      file = read_obj_mesh("fuzz.obj", text);
    }
  } catch (const stream::Error& error) {
    require(!error.parts().cause.empty(), "a cause");
    return false;
  }
  if (!file) return false;
  const TriangleMesh& mesh = file->mesh;
  const std::size_t vertices = mesh.positions.size();
  for (const std::size_t count :
       {mesh.levels.size(), mesh.classes.size(), mesh.colours.size(), mesh.normals.size()}) {
    require(count == 0 || count == vertices, "a value for each vertex or none");
  }
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) require(v < vertices, "corners are vertices");
  }
  require(vertices <= size && mesh.triangles.size() <= size, "no more than the file can hold");
  return true;
}

}  // namespace terrace::tools
