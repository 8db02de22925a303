// SPDX-License-Identifier: Apache-2.0
// Writes a square of two triangles in every mesh format, and a picture.
#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/stream/mesh_writer.hpp>
#include <terrace/stream/png.hpp>

namespace stream = terrace::stream;

int main() {
  try {
    std::string name_of_folder = std::filesystem::temp_directory_path() / "terrace-mesh-XXXXXX";
    if (mkdtemp(name_of_folder.data()) == nullptr) return 1;
    const std::filesystem::path folder = name_of_folder;
    const std::array<stream::Point3, 4> corners{{{691000, 5338000, 500},
                                                 {691100, 5338000, 501},
                                                 {691100, 5338100, 502},
                                                 {691000, 5338100, 501}}};
    const std::array<float, 4> levels{0, 1, 2, 1};
    const std::array<stream::TriangleIndices, 2> triangles{{{0, 1, 2}, {0, 2, 3}}};
    for (const char* name : {"square.ply", "square.obj", "square.glb"}) {
      const auto writer = stream::open_mesh_writer(
          folder / name, {.vertices = 4, .triangles = 2, .attributes = {"level"}},
          {.replace = true});
      writer->add_vertices(corners, levels);
      writer->add_triangles(triangles);
      writer->finish();
      std::printf("%s: %ju bytes\n", name, std::filesystem::file_size(folder / name));
    }
    const std::vector<std::uint8_t> red(16 * 16 * 3, 200);
    stream::write_png(folder / "picture.png", 16, 16, 3, red, /*replace=*/true);
    std::filesystem::remove_all(folder);
  } catch (const stream::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
