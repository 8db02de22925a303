// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <terrace/stream/mesh_reader.hpp>
#include <terrace/stream/mesh_writer.hpp>
#include <terrace/stream/message.hpp>
#include <terrace/stream/point.hpp>
#include <terrace/stream/point_writer.hpp>
#include <terrace/stream/schema.hpp>
#include <terrace/stream/source.hpp>
#include <terrace/stream/store.hpp>

#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// Vertices with their known properties, and triangles between them; a point cloud has no
/// triangles. Optional columns are empty or have the length of `positions`.
struct TriangleMesh {
  std::vector<stream::Point3> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< either orientation
  std::vector<std::uint8_t> levels;                     ///< in a store's hierarchy
  std::vector<std::int32_t> classes;                    ///< class or cluster
  std::vector<std::uint32_t> representatives;  ///< vertex numbers of the clusters' representatives;
                                               ///< any length
  /// Red, green and blue, at most 65,535. 8-bit colours in 16-bit fields, which are common in
  /// clouds, are not scaled.
  std::vector<std::array<std::uint16_t, 3>> colours;
  std::vector<std::array<float, 3>> normals;  ///< unit length
  /// For a cloud that is coarse in places: the number of levels that are left out around each
  /// point.
  std::vector<std::uint8_t> left_out;
};

/// Appends points in stored coordinates, with the attributes that a mesh has columns for, by their
/// usual names. These are level, class, classification or cluster, the colours red, green and blue
/// (of 8 or 16 bits), the normals nx, ny and nz, and representative (the number of the point that
/// represents a point's cluster).
void append_points(TriangleMesh& mesh, const stream::Schema& schema,
                   const stream::PointBlock& points);
/// Converts the mesh of a file (see stream::read_mesh()).
[[nodiscard]] TriangleMesh triangle_mesh_of(stream::MeshFile file);

/// The units of positions; default-constructed, they are unknown.
struct MeshUnits {
  MeshUnits() = default;
  /// The units of a store's coordinates after conversion by `places`.
  explicit MeshUnits(const stream::Store& store, const PlaceConversion& places = {});

  stream::Crs crs{};          ///< CRS of x and y
  std::string height_unit{};  ///< "metre", "foot", ...; empty: as in `crs`
};

/// How a mesh file stores coordinates of a CRS.
///
/// The only unit of glTF is the metre. So in GLB, coordinates that are not metres on the ground are
/// converted to metres. Longitudes and latitudes, and coordinates of a map that stretches lengths
/// by more than a tenth (Web Mercator), are multiplied by one scale east and one north, those of
/// the middle of the mesh, about that middle; feet are multiplied by their length. Heights become
/// metres above the same zero. The conversion is linear, so triangles keep their surfaces and a
/// bound on heights still holds. Coordinates of unknown units stay unchanged. Other formats store
/// all coordinates unchanged.
struct MeshCoordinates {
  std::optional<stream::MeshFrame> frame{};  ///< nullopt: coordinates are unchanged
  stream::Point3 origin{};  ///< origin of the file's scene in the coordinates, if it has a frame
  /// What the user should know about the coordinates in the file, whose name it contains; empty if
  /// there is nothing to report.
  stream::Message note{};
};

/// For a mesh within `bounds` in the file that stream::open_mesh_writer() writes.
[[nodiscard]] MeshCoordinates mesh_coordinates(const std::string& path,
                                               const stream::WriterOptions& options,
                                               const MeshUnits& units, const stream::Box3& bounds);

/// Sets the normals of a mesh's vertices, by tri::vertex_normals() for the coordinates in the file
/// that write_mesh() writes with the same arguments: metres in GLB, otherwise those of the mesh,
/// whatever their units. Throws std::invalid_argument as that function does.
void set_normals(TriangleMesh& mesh, const std::string& path,
                 const stream::WriterOptions& options = {}, const MeshUnits& units = {},
                 unsigned threads = 1);

/// Writes a mesh, with its levels and normals if it has any; "-" is standard output. The file is
/// either complete or absent. Throws: stream::Error, stream::Stopped.
MeshCoordinates write_mesh(const std::string& path, const TriangleMesh& mesh,
                           const stream::WriterOptions& options = {}, const MeshUnits& units = {});

}  // namespace terrace::terrain
