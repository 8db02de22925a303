// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrace/stream/point.hpp"
#include "tile/format/ellipsoid.hpp"

/// Encodes and decodes terrain tiles, quantized-mesh 1.0. Source:
/// https://github.com/CesiumGS/quantized-mesh.

namespace terrace::terrain {

enum class TileExtension : std::uint8_t { oct_normals = 1, water_mask = 2, metadata = 4 };

/// With more vertices than this, indices have 32 bits.
inline constexpr std::size_t kMaxShortVertices = 65536;
/// Number of cells in a water mask that is not uniform.
inline constexpr std::size_t kWaterCells = std::size_t{256} * 256;

/// The largest of the 15-bit numbers that position a vertex between two borders, or between the
/// lowest and the highest height.
inline constexpr std::uint16_t kTileUnits = 32767;

/// The mesh of a tile. u increases from west (0) to east (kTileUnits), v from south to north,
/// height from the lowest (0) to the highest.
struct TileMesh {
  float lowest = 0.0F, highest = 0.0F;  ///< in metres above the ellipsoid
  std::vector<std::uint16_t> u, v, height;
  /// Counter-clockwise seen from above.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// Optional: a unit normal per vertex, in geocentric axes.
  std::vector<std::array<float, 3>> normals;
  /// Optional: 1 value, or 256 x 256 from the north-west corner, row by row; 0 is land, 255 water.
  std::vector<std::uint8_t> water;
  /// Optional: JSON.
  std::string metadata;

  [[nodiscard]] std::size_t size() const { return u.size(); }
  /// The height of a vertex in metres, as a client decodes it.
  [[nodiscard]] double metres(std::size_t vertex) const {
    const double low = lowest, high = highest;
    return low + (high - low) * height[vertex] / kTileUnits;
  }
};

/// The numbers of a tile's header that follow from its mesh and place.
struct TileHeader {
  stream::Point3 centre{};
  Sphere sphere{};
  stream::Point3 horizon_occlusion{};
};

/// Vertices along the four borders; each list goes west to east or south to north.
struct TileEdges {
  std::vector<std::uint32_t> west, south, east, north;
};
TileEdges edges_of(const TileMesh& mesh);

/// Renumbers the vertices in the order in which triangles first use them, as the format requires,
/// and drops unused vertices.
void order_vertices(TileMesh& mesh);

/// Returns the tile's bytes. mesh: in the order of order_vertices(), with a vertex in each corner.
std::vector<std::byte> encode_tile(const TileMesh& mesh, const TileHeader& header);

/// A decoded tile.
struct DecodedTile {
  TileMesh mesh;
  TileHeader header;
  TileEdges edges;
};
/// Decodes a tile. Checks every count against the available bytes and every index against the
/// vertices; `verify` checks the rest (orientation, borders, sphere). `name` is for messages.
/// Throws: stream::Error naming the byte and the fault.
DecodedTile decode_tile(std::span<const std::byte> bytes, const std::string& name);

/// Encode a unit vector in two bytes, and decode it. Source: Z. H. Cigolle et al., A Survey of
/// Efficient Representations for Independent Unit Vectors (2014),
/// https://jcgt.org/published/0003/02/01/.
std::array<std::uint8_t, 2> oct_encode(const std::array<float, 3>& direction);
std::array<float, 3> oct_decode(const std::array<std::uint8_t, 2>& code);

}  // namespace terrace::terrain
