// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "format/mesh/parser.hpp"
#include "format/missing.hpp"
#include "format/registry.hpp"
#include "io/peek.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"
#include "terrace/stream/mesh_reader.hpp"

namespace terrace::stream {
namespace {

/// A format whose parser needs only the input.
struct SimpleFormat {
  const Format& (*format)();
  std::unique_ptr<MeshParser> (*parser)(Input& input, bool faces);
};
constexpr std::array<SimpleFormat, 4> kSimpleFormats{{{&glb_format, &glb_parser},
                                                      {&obj_format, &obj_parser},
                                                      {&off_format, &off_parser},
                                                      {&stl_format, &stl_parser}}};

/// Merges vertices at the same place: gives them one number.
class Welder {
 public:
  explicit Welder(MeshFile& mesh) : mesh_(&mesh) {}
  std::uint32_t number_of(const Point3& place) {
    std::vector<Point3>& positions = mesh_->vertices.positions;
    if (is_missing(place)) {  // NaN has no order
      positions.push_back(place);
      return static_cast<std::uint32_t>(positions.size() - 1);
    }
    const auto [at, is_new] = numbers_.emplace(place, static_cast<std::uint32_t>(positions.size()));
    if (is_new) positions.push_back(place);
    return at->second;
  }

 private:
  MeshFile* mesh_;
  std::map<Point3, std::uint32_t> numbers_;
};

MeshFile read_simple(const std::string& file, const SourceOptions& options,
                     const SimpleFormat& kind) {
  Input input(file, options.stop);
  const auto parser = kind.parser(input, true);
  MeshFile mesh;
  Welder welder(mesh);
  std::vector<std::uint32_t> numbers;  // of a soup's vertices that are not yet in a face
  for (;;) {
    const MeshParser::Item item = parser->next();
    if (item == MeshParser::Item::end) break;
    if (item == MeshParser::Item::vertex) {
      if (parser->is_soup()) {
        numbers.push_back(welder.number_of(parser->vertex()));
      } else {
        mesh.vertices.positions.push_back(parser->vertex());
      }
      continue;
    }
    const std::vector<std::uint32_t>& face = parser->is_soup() ? numbers : parser->face();
    for (std::size_t k = 2; k < face.size(); ++k) {
      mesh.triangles.push_back({face[0], face[k - 1], face[k]});
    }
    numbers.clear();
  }
  mesh.info.format = parser->format();
  mesh.info.files = {file};
  mesh.info.comments = parser->comments();
  mesh.info.points = mesh.vertices.size();
  constexpr std::array kNames{"x", "y", "z"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    mesh.info.coordinates[axis] = {.name = kNames[axis], .type = parser->coordinate_type()};
  }
  if (options.crs) mesh.info.crs = *options.crs;
  return mesh;
}

/// Removes vertices with a coordinate that is NaN, and their triangles.
void remove_missing(MeshFile& mesh) {
  PointBlock& vertices = mesh.vertices;
  constexpr std::uint32_t kLeftOut = std::numeric_limits<std::uint32_t>::max();
  const std::size_t record = mesh.info.payload_size();
  std::vector<std::uint32_t> numbers(vertices.size(), kLeftOut);
  std::uint32_t remaining = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (is_missing(vertices.positions[i])) continue;
    vertices.positions[remaining] = vertices.positions[i];
    std::copy_n(vertices.payload.data() + i * record, record,
                vertices.payload.data() + remaining * record);
    numbers[i] = remaining++;
  }
  if (remaining == vertices.size()) return;
  vertices.positions.resize(remaining);
  vertices.payload.resize(remaining * record);
  mesh.info.points = remaining;
  mesh.nodata = std::erase_if(mesh.triangles, [&](TriangleIndices& triangle) {
    for (std::uint32_t& corner : triangle) corner = numbers[corner];
    return std::find(triangle.begin(), triangle.end(), kLeftOut) != triangle.end();
  });
}

std::optional<MeshFile> read_any_mesh(const std::string& file, const SourceOptions& options) {
  // Do not peek into a pipe: its first bytes would be missing if it is later read as a cloud.
  std::vector<char> head;
  if (options.format.empty() && is_rereadable(file)) head = peek_head(file, 4096, options.stop);
  const auto is_in = [&](const Format& format) {
    if (!options.format.empty()) return options.format == format.name;
    if (!head.empty() && format.recognise(std::as_bytes(std::span(head)))) return true;
    const Format* const named_format = format_of_name(file);
    return named_format != nullptr && named_format->name == format.name &&
           format.name != ply_format().name;
  };
  if (is_in(ply_format())) return read_ply_mesh(file, options);
  for (const SimpleFormat& kind : kSimpleFormats) {
    if (!is_in(kind.format())) continue;
    MeshFile mesh = read_simple(file, options, kind);
    if (mesh.triangles.empty()) return std::nullopt;
    return mesh;
  }
  return std::nullopt;
}

}  // namespace

std::optional<MeshFile> read_mesh(const std::string& file, const SourceOptions& options) {
  std::optional<MeshFile> mesh = read_any_mesh(file, options);
  if (mesh) remove_missing(*mesh);
  return mesh;
}

}  // namespace terrace::stream
