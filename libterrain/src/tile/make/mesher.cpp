// SPDX-License-Identifier: Apache-2.0
#include "tile/make/mesher.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/vector.hpp"
#include "earth/ground.hpp"
#include "surface/window_mesh.hpp"
#include "tile/format/ellipsoid.hpp"
#include "tile/format/quantized_mesh.hpp"
#include "tile/make/crowded_leaf.hpp"
#include "tile/make/sample_parts.hpp"

namespace terrace::terrain {
namespace {

/// The mesh of a leaf or of the whole tile, in units of the tile and steps of height.
struct LeafMesh : WindowMesh<TileVertex> {
  double max_error = 0.0;
  bool has_data = false;
};

/// Returns the error of a leaf with samples in `range`, if no sample becomes a vertex.
double flat_error(const std::vector<TileVertex>& frame, double step, const HeightRange& range) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const TileVertex& vertex : frame) {
    const double height = static_cast<double>(vertex.height) * step;
    low = std::min(low, height);
    high = std::max(high, height);
  }
  return std::max(range.high - low, high - range.low);
}

/// Converts degrees along one axis to units of the tile; rounding never moves a sample out of the
/// leaf.
struct LeafUnits {
  double from = 0.0, units = 0.0;
  double low = 0.0, high = 0.0;  ///< the leaf's sides

  [[nodiscard]] double at(double degrees) const {
    return std::clamp((degrees - from) * units, low, high);
  }
  void convert(std::vector<double>& degrees) const {
    for (double& place : degrees) place = at(place);
  }
  /// Also converts places without a height, which may be outside the tile and are not clamped.
  void convert(std::vector<double>& degrees, std::span<const double> heights) const {
    for (std::size_t i = 0; i < degrees.size(); ++i) {
      degrees[i] = std::isnan(heights[i]) ? (degrees[i] - from) * units : at(degrees[i]);
    }
  }
};

tri::PointTin tin_of(const TileAddress& tile, const TileLeaf& leaf, TileSurface& surface,
                     bool measured, std::span<const tri::Point3> frame,
                     const tri::PointTinOptions& options) {
  const GeographicBox tile_box = box_of(tile);
  const double units = kTileUnits / (tile_box.east - tile_box.west);
  const auto units_along = [&](double from, std::uint32_t part) {
    return LeafUnits{from, units, static_cast<double>(leaf_unit(part, leaf.depth)),
                     static_cast<double>(leaf_unit(part + 1, leaf.depth))};
  };
  const LeafUnits across = units_along(tile_box.west, leaf.x);
  const LeafUnits down = units_along(tile_box.south, leaf.y);
  if (!measured) return tri::point_tin(tri::SampleRows{}, frame, options);
  if (is_to_be_cut(box_of(tile, leaf), surface)) {
    return mesh_crowded_leaf(tile, leaf, frame, options, surface);
  }
  SurfacePart part = surface.part(box_of(tile, leaf));
  if (auto* const rows = std::get_if<SurfaceRows>(&part)) {
    across.convert(rows->longitude);
    down.convert(rows->latitude);
    return tri::point_tin(tri::SampleRows{rows->longitude, rows->latitude, rows->height}, frame,
                          options);
  }
  if (auto* const grid = std::get_if<SurfaceGrid>(&part)) {
    across.convert(grid->longitude, grid->height);
    down.convert(grid->latitude, grid->height);
    return tri::point_tin(
        tri::SampleGrid{grid->columns, grid->longitude, grid->latitude, grid->height}, frame,
        options);
  }
  auto& samples = std::get<SurfaceSamples>(part);
  across.convert(samples.longitude);
  down.convert(samples.latitude);
  // Different places may be one on the globe, as at 180 degrees. The highest is used, so that the
  // result does not depend on their order.
  tri::PointTinOptions highest = options;
  highest.duplicates = tri::PointDuplicates::max;
  return tri::point_tin(samples.longitude, samples.latitude, samples.height, frame, highest);
}

/// frame: from TileSides. has_data: whether the tile is known to have a sample.
LeafMesh mesh_leaf(const TileAddress& tile, const TileLeaf& leaf, const ZoomPlan& plan,
                   TileSurface& surface, tri::TinQuality quality, std::vector<TileVertex>&& frame,
                   bool has_data) {
  LeafMesh mesh;
  const auto range = surface.range(box_of(tile, leaf));
  bool measured = false;
  if (range) {
    const double error = flat_error(frame, plan.height_step, *range);
    if (error <= plan.max_error && (range->certain || has_data)) {
      // All triangulations are within the bound, so nothing needs to be read.
      mesh.max_error = error;
      mesh.has_data = true;
    } else {
      measured = true;
    }
  }
  std::vector<tri::Point3> corners;
  corners.reserve(frame.size());
  for (const TileVertex& vertex : frame) {
    corners.push_back({static_cast<double>(vertex.u), static_cast<double>(vertex.v),
                       static_cast<double>(vertex.height) * plan.height_step});
  }
  tri::PointTinOptions options;
  options.max_error = plan.max_error;
  options.quality = quality;
  options.lattice = tri::TinLattice{0.0, plan.height_step};
  tri::PointTin tin = tin_of(tile, leaf, surface, measured, corners, options);
  if (measured) mesh.max_error = tin.errors.largest;
  if (tin.errors.covered > 0) mesh.has_data = true;

  for (std::uint32_t i = 0; i < frame.size(); ++i) {
    mesh.shared.push_back({.vertex = i, .place = frame[i].v << 16 | frame[i].u});
  }
  mesh.vertices = std::move(frame);
  for (std::size_t i = mesh.vertices.size(); i < tin.vertices.size(); ++i) {
    const tri::Point3& p = tin.vertices[i];
    mesh.vertices.push_back({static_cast<std::uint32_t>(p[0]), static_cast<std::uint32_t>(p[1]),
                             std::llround(p[2] / plan.height_step)});
  }
  mesh.triangles = std::move(tin.triangles);
  return mesh;
}

/// Meshes a tile leaf by leaf. Parameters: as make_tile().
LeafMesh mesh_leaves(const TileAddress& tile, const ZoomPlan& plan, TileSurface& surface,
                     tri::TinQuality quality, SharedSides* shared) {
  LeafMesh joined;
  TileSides sides(tile, plan, surface, shared);
  const std::vector<TileLeaf> leaves = leaves_of(tile, plan, surface);
  // On one thread, because others make other tiles. Then each leaf follows the previous one's take.
  mesh_windows(
      leaves.size(), 1, [&] { surface.check_stop(); },
      [&](unsigned, std::size_t i) {
        const GeographicBox box = box_of(tile, leaves[i]);
        const auto range = surface.range(box);
        // If heights differ by less than the bound, usually only the sides are read.
        if (range && range->high - range->low > plan.max_error) surface.expect(box);
        return mesh_leaf(tile, leaves[i], plan, surface, quality, sides.around(leaves[i]),
                         joined.has_data);
      },
      [&](std::size_t, const LeafMesh& leaf) {
        joined.vertices.insert(joined.vertices.end(), leaf.vertices.begin(), leaf.vertices.end());
        joined.triangles.insert(joined.triangles.end(), leaf.triangles.begin(),
                                leaf.triangles.end());
        joined.max_error = std::max(joined.max_error, leaf.max_error);
        joined.has_data = joined.has_data || leaf.has_data;
      });
  return joined;
}

/// Sets heights as 15-bit numbers from the lowest to the highest, which clients use for culling.
/// Each of two neighbours decodes a shared height to within half of such a number. Returns the
/// largest change of a vertex.
double set_heights(const std::vector<TileVertex>& vertices, double step, TileMesh& mesh) {
  std::int64_t lowest = vertices.front().height, highest = lowest;
  for (const TileVertex& vertex : vertices) {
    lowest = std::min(lowest, vertex.height);
    highest = std::max(highest, vertex.height);
  }
  // Both ends must be exact as floats.
  constexpr std::int64_t kExactAsFloat = std::int64_t{1} << 24;
  const std::int64_t range = highest - lowest;
  if (range > kTileUnits || lowest < -kExactAsFloat || highest > kExactAsFloat) {
    throw HeightRangeTooLarge();
  }
  mesh.lowest = static_cast<float>(static_cast<double>(lowest) * step);
  mesh.highest = static_cast<float>(static_cast<double>(highest) * step);
  double moved = 0.0;
  for (const TileVertex& vertex : vertices) {
    mesh.u.push_back(static_cast<std::uint16_t>(vertex.u));
    mesh.v.push_back(static_cast<std::uint16_t>(vertex.v));
    const std::int64_t above = vertex.height - lowest;
    mesh.height.push_back(static_cast<std::uint16_t>(
        range == 0 ? 0 : (2 * above * kTileUnits + range) / (2 * range)));
    moved = std::max(
        moved, std::abs(mesh.metres(mesh.size() - 1) - static_cast<double>(vertex.height) * step));
  }
  return moved;
}

TileHeader header_of(const TileAddress& tile, const TileMesh& mesh) {
  std::vector<stream::Point3> points;
  points.reserve(mesh.size());
  double low = mesh.metres(0), high = low;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    const double height = mesh.metres(i);
    low = std::min(low, height);
    high = std::max(high, height);
    points.push_back(
        geocentric(longitude_at(tile, mesh.u[i]), latitude_at(tile, mesh.v[i]), height));
  }
  TileHeader header;
  const double middle = kTileUnits / 2.0;
  header.centre =
      geocentric(longitude_at(tile, middle), latitude_at(tile, middle), low + (high - low) / 2.0);
  header.sphere = bounding_sphere(points);
  header.horizon_occlusion = horizon_occlusion_point(header.sphere.centre, points);
  return header;
}

/// Sets normals from the slope of the source over a 256th of the tile, but at least over a sample.
void set_normals(const TileAddress& tile, TileSurface& surface, TileMesh& mesh) {
  const GeographicBox box = box_of(tile);
  const double distance = std::max(surface.spacing(), (box.east - box.west) / 256.0);
  std::vector<double> longitude, latitude;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    const double lon = longitude_at(tile, mesh.u[i]), lat = latitude_at(tile, mesh.v[i]);
    longitude.insert(longitude.end(), {lon - distance, lon + distance, lon, lon});
    // There is no geoid beyond a pole.
    latitude.insert(latitude.end(),
                    {lat, lat, std::max(lat - distance, -90.0), std::min(lat + distance, 90.0)});
  }
  std::vector<double> heights(longitude.size());
  surface.heights(longitude, latitude, heights);
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    const double lon = longitude[4 * i + 2], lat = latitude[4 * i];
    const MetresPerDegree metres = metres_per_degree(lat);
    // All meridians meet at the poles.
    const double east = metres.longitude < 1.0 ? 0.0
                                               : (heights[4 * i + 1] - heights[4 * i]) /
                                                     (2.0 * distance * metres.longitude);
    const bool at_pole = std::abs(lat) + distance > 90.0;
    const double span = at_pole ? latitude[4 * i + 3] - latitude[4 * i + 2] : 2.0 * distance;
    const double north = (heights[4 * i + 3] - heights[4 * i + 2]) / (span * metres.latitude);
    const LocalFrame frame = local_frame(lon, lat);
    stream::Point3 normal;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      normal[axis] = frame.up[axis] - east * frame.east[axis] - north * frame.north[axis];
    }
    normal = unit(normal);
    mesh.normals.push_back({static_cast<float>(normal[0]), static_cast<float>(normal[1]),
                            static_cast<float>(normal[2])});
  }
}

void set_water(const TileAddress& tile, TileSurface& surface, TileMesh& mesh) {
  constexpr unsigned kSide = 256;
  std::vector<double> longitude, latitude;
  for (unsigned row = 0; row < kSide; ++row) {
    for (unsigned column = 0; column < kSide; ++column) {
      longitude.push_back(longitude_at(tile, kTileUnits * (column + 0.5) / kSide));
      latitude.push_back(latitude_at(tile, kTileUnits * (1.0 - (row + 0.5) / kSide)));
    }
  }
  mesh.water.resize(longitude.size());
  surface.water(longitude, latitude, mesh.water);
  for (std::uint8_t& cell : mesh.water) cell = cell != 0 ? 255 : 0;
  const std::uint8_t first = mesh.water.front();
  if (std::all_of(mesh.water.begin(), mesh.water.end(),
                  [first](std::uint8_t cell) { return cell == first; })) {
    mesh.water.assign(1, first);
  }
}

}  // namespace

BuiltTile make_tile(const TileAddress& tile, const ZoomPlan& plan, TileSurface& surface,
                    const TileMeshOptions& options, SharedSides* shared) {
  LeafMesh leaves = mesh_leaves(tile, plan, surface, options.quality, shared);
  BuiltTile built;
  built.has_data = leaves.has_data;
  built.max_error = leaves.max_error + set_heights(leaves.vertices, plan.height_step, built.mesh);
  built.mesh.triangles = std::move(leaves.triangles);
  order_vertices(built.mesh);
  built.header = header_of(tile, built.mesh);
  if (options.normals) set_normals(tile, surface, built.mesh);
  if (options.water) set_water(tile, surface, built.mesh);
  return built;
}

}  // namespace terrace::terrain
