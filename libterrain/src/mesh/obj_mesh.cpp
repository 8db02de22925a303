// SPDX-License-Identifier: Apache-2.0
#include "mesh/obj_mesh.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <string>
#include <system_error>
#include <vector>

#include "mesh/mesh_cursor.hpp"

namespace terrace::terrain {
namespace {

/// The numbers after the key of an OBJ line; of "7/2/3" the first part.
void obj_numbers(std::string_view text, std::vector<double>& numbers) {
  numbers.clear();
  for (;;) {
    const std::size_t start = text.find_first_not_of(" \t");
    if (start == std::string_view::npos) return;
    const std::size_t end = std::min(text.find_first_of(" \t", start), text.size());
    double value = 0;
    const auto [rest, error] = std::from_chars(text.data() + start, text.data() + end, value);
    if (error != std::errc{}) return;
    numbers.push_back(value);
    text.remove_prefix(end);
  }
}

bool looks_like_obj(std::string_view bytes) {
  return bytes.find("\nf ") != std::string_view::npos &&
         (bytes.starts_with("v ") || bytes.find("\nv ") != std::string_view::npos);
}

}  // namespace

std::optional<MeshFile> read_obj_mesh(const std::string& name, std::string_view bytes) {
  if (!looks_like_obj(bytes)) return std::nullopt;
  MeshCursor in(name, bytes);
  MeshFile file;
  TriangleMesh& mesh = file.mesh;
  std::vector<double> numbers;
  while (!in.done()) {
    const std::string_view line = in.line();
    if (line.starts_with("# ")) {
      file.comments += std::string(line.substr(2)) + '\n';
    } else if (line.starts_with("v ")) {
      obj_numbers(line.substr(2), numbers);
      if (numbers.size() < 3) in.fail("a vertex without three coordinates");
      mesh.positions.push_back({numbers[0], numbers[1], numbers[2]});
    } else if (line.starts_with("f ")) {
      obj_numbers(line.substr(2), numbers);
      // Negative indices count back from the last vertex, positive ones from 1.
      for (double& v : numbers) {
        v = v < 0 ? v + static_cast<double>(mesh.positions.size()) : v - 1;
        if (!(v >= 0 && v < static_cast<double>(mesh.positions.size()))) {
          in.fail("a face names a vertex that is not there");
        }
      }
      for (std::size_t k = 2; k < numbers.size(); ++k) {
        mesh.triangles.push_back({static_cast<std::uint32_t>(numbers[0]),
                                  static_cast<std::uint32_t>(numbers[k - 1]),
                                  static_cast<std::uint32_t>(numbers[k])});
      }
    }
  }
  return file;
}

}  // namespace terrace::terrain
