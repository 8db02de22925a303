// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>
#include <terrace/base/portable_math.hpp>
#include <terrace/base/random.hpp>
#include <terrace/stream/error.hpp>

#include "base/vector.hpp"
#include "tile/format/quantized_mesh.hpp"

namespace terrace::terrain {
namespace {

// Makes a lattice of side x side vertices in shuffled order.
TileMesh lattice(std::uint32_t side, std::uint64_t seed) {
  TileMesh mesh;
  mesh.lowest = -12.5F;
  mesh.highest = 4810.25F;
  std::vector<std::uint32_t> place(std::size_t{side} * side);
  for (std::uint32_t i = 0; i < place.size(); ++i) place[i] = i;
  for (std::size_t i = place.size(); i > 1; --i) {
    seed = base::splitmix64(seed);
    std::swap(place[i - 1], place[seed % i]);
  }
  mesh.u.resize(place.size());
  mesh.v.resize(place.size());
  mesh.height.resize(place.size());
  for (std::uint32_t row = 0; row < side; ++row) {
    for (std::uint32_t column = 0; column < side; ++column) {
      const std::uint32_t vertex = place[row * side + column];
      mesh.u[vertex] = static_cast<std::uint16_t>(kTileUnits * column / (side - 1));
      mesh.v[vertex] = static_cast<std::uint16_t>(kTileUnits * row / (side - 1));
      seed = base::splitmix64(seed);
      mesh.height[vertex] = static_cast<std::uint16_t>(seed % (kTileUnits + 1));
    }
  }
  for (std::uint32_t row = 0; row + 1 < side; ++row) {
    for (std::uint32_t column = 0; column + 1 < side; ++column) {
      const std::uint32_t a = place[row * side + column], b = place[row * side + column + 1];
      const std::uint32_t c = place[(row + 1) * side + column + 1];
      const std::uint32_t d = place[(row + 1) * side + column];
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

TileHeader header_of_place() {
  TileHeader header;
  header.centre = geocentric(10, 46, 100);
  header.sphere = {header.centre, 1234.5};
  header.horizon_occlusion = {0.5, 0.25, 0.75};
  return header;
}

void expect_equal(const TileMesh& a, const TileMesh& b) {
  EXPECT_EQ(a.u, b.u);
  EXPECT_EQ(a.v, b.v);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.lowest, b.lowest);
  EXPECT_EQ(a.highest, b.highest);
  EXPECT_EQ(a.water, b.water);
  EXPECT_EQ(a.metadata, b.metadata);
}

TEST(QuantizedMesh, ReadsBack) {
  // 257 x 257 vertices need 32-bit indices, 256 x 256 just do not.
  for (const std::uint32_t side : {2U, 3U, 17U, 256U, 257U}) {
    SCOPED_TRACE(side);
    TileMesh mesh = lattice(side, side);
    order_vertices(mesh);
    mesh.metadata = R"({"available":[]})";
    mesh.water.assign(side == 3 ? 65536 : 1, 255);
    for (std::size_t i = 0; i < mesh.size(); ++i) mesh.normals.push_back({0, 0, 1});
    const auto bytes = encode_tile(mesh, header_of_place());
    const DecodedTile tile = decode_tile(bytes, "test.terrain");
    expect_equal(tile.mesh, mesh);
    EXPECT_EQ(tile.header.centre, header_of_place().centre);
    EXPECT_EQ(tile.header.sphere.radius, 1234.5);
    EXPECT_EQ(tile.header.horizon_occlusion, header_of_place().horizon_occlusion);
    ASSERT_EQ(tile.mesh.normals.size(), mesh.size());
    EXPECT_NEAR(tile.mesh.normals[0][2], 1, 1e-4);
    for (const auto* list :
         {&tile.edges.west, &tile.edges.south, &tile.edges.east, &tile.edges.north}) {
      EXPECT_EQ(list->size(), side);
    }
    EXPECT_EQ(tile.mesh.u[tile.edges.south.front()], 0);
    EXPECT_EQ(tile.mesh.v[tile.edges.west.back()], kTileUnits);
  }
}

TEST(QuantizedMesh, OrderingKeepsTriangles) {
  TileMesh mesh = lattice(9, 4);
  mesh.u.push_back(5);  // a vertex without a triangle
  mesh.v.push_back(5);
  mesh.height.push_back(5);
  const auto corners = [](const TileMesh& m) {
    std::vector<std::array<std::uint16_t, 9>> list;
    for (const auto& t : m.triangles) {
      list.push_back({m.u[t[0]], m.v[t[0]], m.height[t[0]], m.u[t[1]], m.v[t[1]], m.height[t[1]],
                      m.u[t[2]], m.v[t[2]], m.height[t[2]]});
    }
    return list;
  };
  const auto before = corners(mesh);
  order_vertices(mesh);
  EXPECT_EQ(corners(mesh), before);
  EXPECT_EQ(mesh.size(), 81U);
}

TEST(QuantizedMesh, BytesMatchSpecification) {
  TileMesh mesh = lattice(2, 1);
  order_vertices(mesh);
  const auto bytes = encode_tile(mesh, header_of_place());
  // The header has 88 bytes, the count and four vertices 28, two triangles 16, four lists of two
  // 32.
  EXPECT_EQ(bytes.size(), 88U + 28 + 16 + 32);
  const auto word = [&](std::size_t at) {
    std::uint16_t value = 0;
    std::memcpy(&value, bytes.data() + at, 2);
    return value;
  };
  EXPECT_EQ(word(88), 4);                                                    // vertices
  EXPECT_EQ(word(116), 2);                                                   // triangles
  for (const std::size_t i : {0U, 1U, 2U}) EXPECT_EQ(word(120 + 2 * i), 0);  // three new vertices
  EXPECT_EQ(word(126), 3);                                                   // the first one again
}

TEST(QuantizedMesh, RejectsTruncatedTiles) {
  TileMesh mesh = lattice(4, 2);
  order_vertices(mesh);
  mesh.metadata = "{}";
  const auto bytes = encode_tile(mesh, header_of_place());
  const std::size_t before_extension = bytes.size() - (5 + 4 + 2);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    if (size == before_extension) continue;  // a complete tile without the extension
    EXPECT_THROW(decode_tile(std::span(bytes).first(size), "short"), stream::Error) << size;
  }
}

TEST(QuantizedMesh, ReadsOrRejectsDamagedTiles) {
  TileMesh mesh = lattice(5, 3);
  order_vertices(mesh);
  mesh.water = {255};
  for (std::size_t i = 0; i < mesh.size(); ++i) mesh.normals.push_back({0, 1, 0});
  const auto good = encode_tile(mesh, header_of_place());
  std::uint64_t seed = 99;
  int refused = 0;
  for (int round = 0; round < 20000; ++round) {
    auto bytes = good;
    for (int change = 0; change <= round % 3; ++change) {
      seed = base::splitmix64(seed);
      bytes[seed % bytes.size()] = static_cast<std::byte>(seed >> 40);
    }
    try {
      const DecodedTile tile = decode_tile(bytes, "damaged");
      for (const auto& triangle : tile.mesh.triangles) {
        for (const std::uint32_t vertex : triangle) ASSERT_LT(vertex, tile.mesh.size());
      }
      for (const std::uint32_t vertex : tile.edges.north) ASSERT_LT(vertex, tile.mesh.size());
    } catch (const stream::Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000);
}

TEST(QuantizedMesh, NormalsDecodeWithinADegree) {
  std::uint64_t seed = 12;
  const auto random = [&] {
    seed = base::splitmix64(seed);
    return 2 * base::unit_interval(seed) - 1;
  };
  for (int round = 0; round < 20000; ++round) {
    stream::Point3 d{random(), random(), random()};
    if (round % 10 == 0) d[static_cast<std::size_t>(round / 10) % 3] = 0;
    if (dot(d, d) == 0) continue;
    d = unit(d);
    const auto back = oct_decode(
        oct_encode({static_cast<float>(d[0]), static_cast<float>(d[1]), static_cast<float>(d[2])}));
    EXPECT_GT(dot(d, {back[0], back[1], back[2]}), std::cos(1.0 * base::kRadiansPerDegree));
  }
}

}  // namespace
}  // namespace terrace::terrain
