// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <terrace/stream/mesh_reader.hpp>
#include <terrace/stream/mesh_writer.hpp>
#include <terrace/stream/point.hpp>
#include <terrace/stream/point_writer.hpp>
#include <terrace/stream/schema.hpp>
#include <terrace/stream/source.hpp>
#include <terrace/stream/store.hpp>

#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// Vertices with what is known of them, and triangles between them: none for a cloud of points.
/// The optional columns are empty or as long as `positions`.
struct TriangleMesh {
  std::vector<stream::Point3> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< either orientation
  std::vector<std::uint8_t> levels;                     ///< of a store
  std::vector<std::int32_t> classes;                    ///< class or cluster
  std::vector<std::uint32_t> representatives;  ///< of the clusters: vertex numbers, any length
  /// Red, green and blue, 65,535 at most. Colours of 8 bits in fields of 16, which are common in
  /// clouds, are not scaled.
  std::vector<std::array<std::uint16_t, 3>> colours;
  std::vector<std::array<float, 3>> normals;  ///< unit length
  /// For a cloud that is coarse somewhere: how many levels are left out around each point.
  std::vector<std::uint8_t> left_out;
};

/// Appends points, in stored coordinates, with those of their attributes that a mesh has a column
/// for, by their usual names: level; class, classification or cluster; red, green, blue (of 16 bits
/// too); nx, ny, nz; representative (the number of the point that represents a point's cluster).
void append_points(TriangleMesh& mesh, const stream::Schema& schema,
                   const stream::PointBlock& points);
/// The mesh of a file (see stream::read_mesh()).
[[nodiscard]] TriangleMesh triangle_mesh_of(stream::MeshFile file);

/// The units of positions: made by default they are not known.
struct MeshUnits {
  MeshUnits() = default;
  /// The units of coordinates from a store after `places` has converted them.
  explicit MeshUnits(const stream::Store& store, const PlaceConversion& places = {});

  stream::Crs crs{};          ///< of x and y
  std::string height_unit{};  ///< "metre", "foot", ...; empty: as `crs` says
};

/// What a mesh file has for the coordinates of a CRS.
///
/// glTF has no unit but the metre. So in GLB coordinates that are not metres on the ground become
/// metres: longitudes and latitudes, and those of a map that stretches lengths by more than a tenth
/// (Web Mercator), by one scale east and one north, those of the middle of the mesh, about that
/// middle; feet by their length. Heights become metres above the same zero. A linear map leaves
/// triangles the surfaces that they are, so a bound on heights holds as before. Without known units
/// nothing changes. Other formats have the coordinates as they are.
struct MeshCoordinates {
  std::optional<stream::MeshFrame> frame{};  ///< nullopt: the coordinates themselves
  stream::Point3 origin{};  ///< of the file's scene, in the coordinates, if it has a frame
  /// What the user should know of the coordinates in the file; empty: nothing. Names the file.
  std::string note{};
};

/// For a mesh within `bounds`, and the file that stream::open_mesh_writer() writes.
[[nodiscard]] MeshCoordinates mesh_coordinates(const std::string& path,
                                               const stream::WriterOptions& options,
                                               const MeshUnits& units, const stream::Box3& bounds);

/// Writes a mesh, with its levels where it has any; "-" is standard output. The file is whole or
/// not there. Throws: stream::Error, stream::Stopped.
MeshCoordinates write_mesh(const std::string& path, const TriangleMesh& mesh,
                           const stream::WriterOptions& options = {}, const MeshUnits& units = {});

}  // namespace terrace::terrain
