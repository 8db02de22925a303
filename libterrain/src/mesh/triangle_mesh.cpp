// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/triangle_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/file_marks.hpp"
#include "terrace/stream/mesh_writer.hpp"

namespace terrace::terrain {
namespace {

/// The number of the first attribute with one of these names.
std::optional<std::size_t> attribute(const stream::Schema& schema,
                                     std::initializer_list<const char*> names) {
  for (std::size_t i = 0; i < schema.attributes.size(); ++i) {
    for (const char* name : names) {
      if (schema.attributes[i].name == name) return i;
    }
  }
  return std::nullopt;
}

template <class T>
T clamped(double value) {
  const double low = std::numeric_limits<T>::lowest(), high = std::numeric_limits<T>::max();
  return static_cast<T>(std::isnan(value) ? 0 : std::clamp(value, low, high));
}

}  // namespace

void append_points(TriangleMesh& mesh, const stream::Schema& schema,
                   const stream::PointBlock& points) {
  const std::size_t before = mesh.positions.size(), record_bytes = schema.payload_size();
  mesh.positions.insert(mesh.positions.end(), points.positions.begin(), points.positions.end());
  const auto red = attribute(schema, {"red"}), green = attribute(schema, {"green"}),
             blue = attribute(schema, {"blue"});
  const auto nx = attribute(schema, {"nx"}), ny = attribute(schema, {"ny"}),
             nz = attribute(schema, {"nz"});
  const auto group = attribute(schema, {"class", "classification", "cluster"});
  const auto level = attribute(schema, {"level"});
  const auto representative = attribute(schema, {"representative"});
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::byte* const record = points.payload.data() + i * record_bytes;
    const auto value = [&](std::size_t column) {
      return stream::to_double(schema.attributes[column].type,
                               record + schema.attribute_offset(column));
    };
    if (red && green && blue) {
      const auto share = [&](std::size_t column) {
        // The type tells 16-bit colours apart; floats range from 0 to 255.
        const bool wide = schema.attributes[column].type == stream::ScalarType::u16;
        return clamped<std::uint16_t>(wide ? value(column) : value(column) * 257);
      };
      mesh.colours.push_back({share(*red), share(*green), share(*blue)});
    }
    if (nx && ny && nz) {
      mesh.normals.push_back({static_cast<float>(value(*nx)), static_cast<float>(value(*ny)),
                              static_cast<float>(value(*nz))});
    }
    if (group) mesh.classes.push_back(clamped<std::int32_t>(value(*group)));
    // The column holds the number of the point that represents this one's cluster.
    if (representative && value(*representative) == static_cast<double>(before + i)) {
      mesh.representatives.push_back(static_cast<std::uint32_t>(before + i));
    }
    if (level) mesh.levels.push_back(clamped<std::uint8_t>(value(*level)));
  }
}

TriangleMesh triangle_mesh_of(stream::MeshFile file) {
  TriangleMesh mesh;
  append_points(mesh, file.info, file.vertices);
  mesh.triangles = std::move(file.triangles);
  return mesh;
}

void write_mesh(const std::string& path, const TriangleMesh& mesh,
                const stream::WriterOptions& options) {
  constexpr std::size_t kPiece = 65536;
  stream::Box3 bounds;
  for (const stream::Point3& p : mesh.positions) bounds.include(p);
  stream::MeshHeader header;
  header.vertices = mesh.positions.size();
  header.triangles = mesh.triangles.size();
  if (!mesh.levels.empty()) header.attributes = {"level"};
  header.comments = {kWriterMark};
  if (!bounds.empty()) header.bounds = bounds;
  const auto writer = stream::open_mesh_writer(path, header, options);
  std::vector<float> levels;
  const std::span vertices(mesh.positions);
  for (std::size_t at = 0; at < vertices.size(); at += kPiece) {
    const std::size_t count = std::min(kPiece, vertices.size() - at);
    if (!mesh.levels.empty()) {
      levels.assign(mesh.levels.begin() + static_cast<std::ptrdiff_t>(at),
                    mesh.levels.begin() + static_cast<std::ptrdiff_t>(at + count));
    }
    writer->add_vertices(vertices.subspan(at, count), levels);
  }
  writer->add_triangles(mesh.triangles);
  writer->finish();
}

}  // namespace terrace::terrain
