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

#include <fmt/core.h>
#include <terrace/tri/shape.hpp>

#include "base/file_marks.hpp"
#include "base/units.hpp"
#include "earth/crs/definition.hpp"
#include "earth/ground.hpp"
#include "terrace/stream/mesh_writer.hpp"

namespace terrace::terrain {
namespace {

/// Returns the index of the first attribute with one of these names.
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

/// Returns a suitable projection for a place of longitude and latitude in degrees.
std::string projection_at(double longitude, double latitude) {
  if (latitude > 84) return "EPSG:5041";
  if (latitude < -80) return "EPSG:5042";
  const double turned = longitude - 360 * std::floor((longitude + 180) / 360);
  const double zone = std::clamp(std::floor((turned + 180) / 6) + 1, 1.0, 60.0);
  return fmt::format("EPSG:{}", (latitude < 0 ? 32700 : 32600) + static_cast<int>(zone));
}

/// The facts that mesh_coordinates() and the note are based on.
struct Coordinates {
  Coordinates(const MeshUnits& units, const stream::Box3& bounds) : crs(units.crs) {
    stream::Placement placement;
    placement.crs = crs;
    placement.coordinates[2].unit = units.height_unit;
    const Ground ground(placement);
    height_unit = ground.height_unit();
    known = crs.epsg != 0 || !crs.wkt.empty() || crs.geographic || !crs.horizontal_unit.empty();
    if (bounds.empty()) return;
    if (!known) {
      metres[2] = ground.metres_vertical();
      return;
    }
    for (std::size_t axis = 0; axis < 2; ++axis) {
      middle[axis] = bounds.min[axis] * 0.5 + bounds.max[axis] * 0.5;
    }
    // Without a place on the earth, only the unit is known.
    const GroundMap unit = ground.map({}), local_map = ground.map(bounds);
    metres = {unit[0], unit[4], unit[8]};
    width = bounds.max[0] - bounds.min[0];
    // In their areas of use, maps stretch lengths by a few percent.
    constexpr double kStretched = 0.1;
    const double east = local_map[0] / unit[0], north = local_map[4] / unit[4];
    const bool stretched = std::abs(east - 1) > kStretched || std::abs(north - 1) > kStretched;
    // Far from its centre, a map does not preserve right angles either.
    const bool straight =
        std::abs(local_map[1]) <= kStretched * std::min(local_map[0], local_map[4]);
    degrees = !ground.same_everywhere() && !ground.projected() && north > 10000;  // metres
    // Numbers beyond the poles are not latitudes.
    const bool apart = degrees && std::max(-bounds.min[1], bounds.max[1]) * north > 1.02e7;
    if (!stretched || !straight || apart) return;
    local = true;
    // At a pole there is no east.
    metres = {std::max(local_map[0], 0x1p-20 * local_map[4]), local_map[4], local_map[8]};
    if (!degrees) return;
    for (const double latitude : {bounds.min[1], bounds.max[1]}) {
      const double length = ground.map({{0, latitude, 0}, {0, latitude, 0}})[0];
      widest_error = std::max(widest_error, std::abs(length / metres[0] - 1));
    }
  }

  /// Returns "; heights are converted from feet" or similar; empty if they are in metres.
  [[nodiscard]] std::string height_note() const {
    return metres[2] == 1 ? "" : "; heights are converted from " + plural_unit(height_unit);
  }
  [[nodiscard]] bool is_unchanged() const { return !local && metres == stream::Point3{1, 1, 1}; }
  [[nodiscard]] std::string name() const {
    return crs.epsg != 0 ? fmt::format("EPSG:{}", crs.epsg) : crs.name;
  }
  [[nodiscard]] std::string horizontal_unit() const {
    if (!crs.horizontal_unit.empty()) return plural_unit(crs.horizontal_unit);
    return degrees ? "degrees" : metres[0] == 1 ? "metres" : "feet";
  }
  [[nodiscard]] std::string projection() const {
    // Requires degrees, not grads, and a mesh so narrow that the projection does not stretch
    // lengths itself.
    const bool common = metres[1] > 1.05e5 && metres[1] < 1.2e5 && width < 12;
    return degrees && common ? " " + projection_at(middle[0], middle[1]) : " EPSG:n";
  }

  stream::Crs crs;
  stream::Point3 metres{1, 1, 1};
  Point2 middle{};
  double width = 0;
  std::string height_unit;
  bool known = false;  ///< whether the unit of x and y is known
  bool local = false, degrees = false;
  double widest_error = 0;  ///< relative error of lengths from west to east
};

stream::Message note_in_metres(const Coordinates& facts) {
  const std::string name = facts.name().empty() ? "" : " of " + facts.name();
  const std::string back = "; asset.extras says how to get the coordinates" + name + " back";
  if (!facts.local && facts.metres[0] == 1) {
    return "heights are converted from " + plural_unit(facts.height_unit) +
           " to metres, as glTF requires" + (facts.known ? "" : ", and x and y taken for metres") +
           back;
  }
  if (!facts.local) {
    const bool same = std::abs(facts.metres[0] / facts.metres[2] - 1) < 1e-9;
    return "in metres, as glTF requires, in place of " + facts.horizontal_unit() +
           (same                   ? ""
            : facts.metres[2] == 1 ? "; heights are metres"
                                   : facts.height_note()) +
           back;
  }
  stream::Message note =
      fmt::format("in metres, as glTF requires, east and north of {}, {}{}",
                  readable_number(facts.middle[0], 10), readable_number(facts.middle[1], 10), name);
  if (facts.widest_error >= 0.001) {
    note += fmt::format(
        "; lengths from west to east are exact there and off by up to {} % at the border",
        readable_number(100 * facts.widest_error, 2));
    if (facts.widest_error >= 0.01) {
      note +=
          stream::message(" (a projection, as {to_crs}{}, is more accurate)", facts.projection());
    }
  }
  return note + facts.height_note() + "; asset.extras says how to get the coordinates back";
}

stream::Message note_unchanged(const Coordinates& facts, const MeshUnits& units) {
  const bool same = std::abs(facts.metres[0] / facts.metres[2] - 1) < 1e-3;
  if (!facts.known || (!facts.local && same)) return {};
  std::string heights = units.height_unit.empty() ? facts.crs.vertical_unit : units.height_unit;
  if (!metres_in_unit(heights)) heights = "metre";
  const std::string what = facts.degrees || !facts.local
                               ? facts.horizontal_unit()
                               : "metres of a map that stretches lengths to " +
                                     readable_number(1 / facts.metres[0]) + " times";
  // A conversion leaves heights as they are.
  const stream::Message convert =
      metres_in_unit(heights) == 1.0
          ? stream::message("pass {to_crs}{} for metres, or ", facts.projection())
          : "";
  return stream::message(
      "x and y are {} and heights {}, which most programs read as one unit; {}write GLB, which is "
      "in metres",
      what, plural_unit(heights), convert);
}

}  // namespace

MeshUnits::MeshUnits(const stream::Store& store, const PlaceConversion& places)
    : crs(store.schema().crs), height_unit(store.schema().coordinates[2].unit) {
  const std::optional<stream::Crs> other = places.crs();
  if (!other) return;
  // Heights do not change; they keep the unit that they have with the store's own x and y.
  height_unit = Ground(store.schema()).height_unit();
  const stream::Crs target = std::exchange(crs, *other);
  crs.vertical_epsg = target.vertical_epsg;
  crs.vertical_unit = target.vertical_unit;
}

MeshCoordinates mesh_coordinates(const std::string& path, const stream::WriterOptions& options,
                                 const MeshUnits& units, const stream::Box3& bounds) {
  const Coordinates facts(units, bounds);
  MeshCoordinates out;
  if (stream::mesh_format(path, options) != "glb") {
    out.note = note_unchanged(facts, units);
  } else if (!facts.is_unchanged()) {
    const std::string text =
        facts.crs.epsg == 0 && !facts.crs.wkt.empty() ? facts.crs.wkt : facts.name();
    out.frame = {.metres = facts.metres, .local = facts.local, .crs = text};
    if (facts.local) out.origin = {facts.middle[0], facts.middle[1], 0};
    out.note = note_in_metres(facts);
  }
  if (!out.note.empty()) out.note = stream::message("{}: {}", path, out.note);
  return out;
}

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
        // The type identifies 16-bit colours; floats range from 0 to 255.
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
    // The column contains the number of the point that represents this point's cluster.
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

void set_normals(TriangleMesh& mesh, const std::string& path, const stream::WriterOptions& options,
                 const MeshUnits& units, unsigned threads) {
  stream::Box3 bounds;
  for (const stream::Point3& p : mesh.positions) bounds.include(p);
  const auto frame = mesh_coordinates(path, options, units, bounds).frame;
  const stream::Point3 metres = frame ? frame->metres : stream::Point3{1, 1, 1};
  tri::Surface surface{mesh.positions, std::move(mesh.triangles)};
  for (stream::Point3& p : surface.points) {
    for (std::size_t axis = 0; axis < 3; ++axis) p[axis] *= metres[axis];
  }
  const std::vector<tri::Point3> normals = tri::vertex_normals(surface, threads);
  mesh.triangles = std::move(surface.faces);
  mesh.normals.clear();
  mesh.normals.reserve(normals.size());
  for (const tri::Point3& n : normals) {
    mesh.normals.push_back(
        {static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])});
  }
}

MeshCoordinates write_mesh(const std::string& path, const TriangleMesh& mesh,
                           const stream::WriterOptions& options, const MeshUnits& units) {
  constexpr std::size_t kPiece = 65536;
  stream::Box3 bounds;
  for (const stream::Point3& p : mesh.positions) bounds.include(p);
  stream::MeshHeader header;
  header.vertices = mesh.positions.size();
  header.triangles = mesh.triangles.size();
  if (!mesh.levels.empty()) header.attributes = {"level"};
  if (!mesh.normals.empty()) {
    header.attributes.insert(header.attributes.end(), {"nx", "ny", "nz"});
  }
  header.comments = {kWriterMark};
  if (!bounds.empty()) header.bounds = bounds;
  MeshCoordinates coordinates = mesh_coordinates(path, options, units, bounds);
  header.frame = coordinates.frame;
  const auto writer = stream::open_mesh_writer(path, header, options);
  std::vector<float> values;
  const std::span vertices(mesh.positions);
  for (std::size_t at = 0; at < vertices.size(); at += kPiece) {
    const std::size_t count = std::min(kPiece, vertices.size() - at);
    values.clear();
    for (std::size_t v = at; v < at + count; ++v) {
      if (!mesh.levels.empty()) values.push_back(mesh.levels[v]);
      if (!mesh.normals.empty()) {
        values.insert(values.end(), mesh.normals[v].begin(), mesh.normals[v].end());
      }
    }
    writer->add_vertices(vertices.subspan(at, count), values);
  }
  writer->add_triangles(mesh.triangles);
  writer->finish();
  return coordinates;
}

}  // namespace terrace::terrain
