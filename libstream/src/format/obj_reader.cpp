// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "format/mesh_formats.hpp"
#include "io/line_reader.hpp"
#include "io/number.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

/// Wavefront OBJ: lines "v x y z" and "f a b c ...", the rest left out.
class ObjReader {
 public:
  ObjReader(const std::string& file, const SourceOptions& options)
      : input_(file, options.stop), lines_(input_) {
    mesh_.info.format = "obj";
    mesh_.info.files = {file};
    constexpr std::array kNames{"x", "y", "z"};
    for (std::size_t axis = 0; axis < 3; ++axis) mesh_.info.coordinates[axis].name = kNames[axis];
    if (options.crs) mesh_.info.crs = *options.crs;
  }

  MeshFile read() {
    std::string_view line;
    while (lines_.next(line)) {
      if (line.starts_with("# ")) {
        mesh_.info.comments.emplace_back(line.substr(2));
      } else if (line.starts_with("v ")) {
        add_vertex(line.substr(2));
      } else if (line.starts_with("f ")) {
        add_face(line.substr(2));
      }
    }
    mesh_.info.points = mesh_.vertices.size();
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void fail(std::string cause) const {
    throw Error({.file = input_.name(),
                 .where = "line " + std::to_string(lines_.number()),
                 .cause = std::move(cause),
                 .remedy = "the file is damaged; write it anew"});
  }

  void add_vertex(std::string_view text) {
    Point3 place{};
    for (double& value : place) {
      text = trim_left(text);
      const char* const end = text.data() + text.size();
      const char* const rest = parse_real(text.data(), end, value);
      if (rest == nullptr || !std::isfinite(value)) fail("a vertex without three coordinates");
      text = {rest, static_cast<std::size_t>(end - rest)};
    }
    mesh_.vertices.positions.push_back(place);
  }

  /// Corners are "7", "7/2", "7/2/3" or "7//3": the first number is the vertex. Negative ones count
  /// back from the last vertex so far, positive ones from 1.
  void add_face(std::string_view text) {
    corners_.clear();
    const auto vertices = static_cast<std::int64_t>(mesh_.vertices.size());
    for (text = trim_left(text); !text.empty();) {
      const std::string_view word = text.substr(0, text.find_first_of(" \t"));
      std::int64_t number = 0;
      const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), number);
      const bool ends = rest == word.data() + word.size() || *rest == '/';
      const std::int64_t vertex = number < 0 ? number + vertices : number - 1;
      if (error != std::errc{} || !ends || vertex < 0 || vertex >= vertices ||
          vertex >= std::numeric_limits<std::uint32_t>::max()) {
        fail("a face names the vertex " + in_quotes(word) + ", which is not there");
      }
      corners_.push_back(static_cast<std::uint32_t>(vertex));
      text = trim_left(text.substr(word.size()));
    }
    for (std::size_t k = 2; k < corners_.size(); ++k) {
      mesh_.triangles.push_back({corners_[0], corners_[k - 1], corners_[k]});
    }
  }

  Input input_;
  LineReader lines_;
  MeshFile mesh_;
  std::vector<std::uint32_t> corners_;
};

}  // namespace

std::optional<MeshFile> read_obj_mesh(const std::string& file, const SourceOptions& options) {
  MeshFile mesh = ObjReader(file, options).read();
  if (mesh.triangles.empty()) return std::nullopt;
  return mesh;
}

}  // namespace terrace::stream
