// SPDX-License-Identifier: Apache-2.0
#include <string_view>
#include <vector>

#include "fuzz_points.hpp"
#include "terrace/stream/mesh_reader.hpp"

/// Any input is refused as PLY, GLB, OBJ, OFF and STL, or gives triangles of existing vertices,
/// with a complete record for each vertex, and no more of them than the file can hold. Streaming
/// gives the same number of triangles.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  WorkLimit limit(size);
  const MemoryFile file(data, size);
  for (const char* format : {"ply", "glb", "obj", "off", "stl"}) {
    try {
      const auto source = open_source(std::vector{file.name()},
                                      {.format = format, .entities = Entities::triangles});
      std::size_t streamed = 0;
      for (PointBlock block; source->next(block);) {
        require(block.payload.size() == block.size() * source->info().payload_size(),
                "each point has a record");
        streamed += block.size();
      }
      const auto mesh = read_mesh(file.name(), {.format = format});
      require(mesh && mesh->triangles.size() == streamed, "streaming gives as many triangles");
    } catch (const Error& error) {
      require(!error.parts().cause.empty(), "errors have a cause");
    }
    try {
      const auto mesh = read_mesh(file.name(), {.format = format});
      if (!mesh) continue;
      const std::size_t vertices = mesh->vertices.size();
      limit.add(vertices + mesh->triangles.size());
      require(mesh->vertices.payload.size() == vertices * mesh->info.payload_size(),
              "each vertex has a record");
      for (const TriangleIndices& triangle : mesh->triangles) {
        for (const std::uint32_t v : triangle) require(v < vertices, "corners are vertices");
      }
      // The nodes of a GLB may place one mesh many times.
      const std::size_t max_items = std::string_view(format) == "glb" ? size * size : size;
      require(vertices <= max_items && mesh->triangles.size() <= max_items,
              "the mesh fits the file's size");
    } catch (const Error& error) {
      require(!error.parts().cause.empty(), "errors have a cause");
    }
  }
  return 0;
}
