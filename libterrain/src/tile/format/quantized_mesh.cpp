// SPDX-License-Identifier: Apache-2.0
#include "tile/format/quantized_mesh.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>
#include <type_traits>
#include <utility>

namespace terrace::terrain {
namespace {

static_assert(std::endian::native == std::endian::little, "tiles are little-endian");

// Appends the bytes of values in memory.
class Writer {
 public:
  template <class T>
  void put(const T& value) {
    const auto* first = reinterpret_cast<const std::byte*>(&value);
    bytes_.insert(bytes_.end(), first, first + sizeof(T));
  }
  void put(const stream::Point3& p) {
    for (const double c : p) put(c);
  }
  void align(std::size_t to) { bytes_.resize((bytes_.size() + to - 1) / to * to); }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

void put_column(Writer& out, const std::vector<std::uint16_t>& values) {
  int last = 0;
  for (const std::uint16_t value : values) {
    const int delta = value - last;
    out.put(static_cast<std::uint16_t>((delta << 1) ^ (delta >> 31)));
    last = value;
  }
}

template <class Index>
void put_indices(Writer& out, const TileMesh& mesh, const TileEdges& edges) {
  out.put(static_cast<std::uint32_t>(mesh.triangles.size()));
  std::uint32_t highest = 0;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t vertex : triangle) {
      assert(vertex <= highest);
      out.put(static_cast<Index>(highest - vertex));
      if (vertex == highest) ++highest;
    }
  }
  for (const auto* list : {&edges.west, &edges.south, &edges.east, &edges.north}) {
    out.put(static_cast<std::uint32_t>(list->size()));
    for (const std::uint32_t vertex : *list) out.put(static_cast<Index>(vertex));
  }
}

void put_extension(Writer& out, TileExtension id, std::size_t bytes) {
  out.put(static_cast<std::uint8_t>(id));
  out.put(static_cast<std::uint32_t>(bytes));
}

}  // namespace

TileEdges edges_of(const TileMesh& mesh) {
  TileEdges edges;
  for (std::uint32_t vertex = 0; vertex < mesh.size(); ++vertex) {
    if (mesh.u[vertex] == 0) edges.west.push_back(vertex);
    if (mesh.u[vertex] == kTileUnits) edges.east.push_back(vertex);
    if (mesh.v[vertex] == 0) edges.south.push_back(vertex);
    if (mesh.v[vertex] == kTileUnits) edges.north.push_back(vertex);
  }
  const auto sort_by = [](std::vector<std::uint32_t>& list, const std::vector<std::uint16_t>& key) {
    std::sort(list.begin(), list.end(), [&](std::uint32_t a, std::uint32_t b) {
      return key[a] != key[b] ? key[a] < key[b] : a < b;
    });
  };
  sort_by(edges.west, mesh.v);
  sort_by(edges.east, mesh.v);
  sort_by(edges.south, mesh.u);
  sort_by(edges.north, mesh.u);
  return edges;
}

void order_vertices(TileMesh& mesh) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(mesh.size(), kUnused), order;
  order.reserve(mesh.size());
  for (auto& triangle : mesh.triangles) {
    for (std::uint32_t& vertex : triangle) {
      if (number[vertex] == kUnused) {
        number[vertex] = static_cast<std::uint32_t>(order.size());
        order.push_back(vertex);
      }
      vertex = number[vertex];
    }
  }
  const auto reorder = [&](auto& column) {
    if (column.empty()) return;
    std::remove_reference_t<decltype(column)> sorted;
    sorted.reserve(order.size());
    for (const std::uint32_t vertex : order) sorted.push_back(column[vertex]);
    column = std::move(sorted);
  };
  reorder(mesh.u);
  reorder(mesh.v);
  reorder(mesh.height);
  reorder(mesh.normals);
}

std::vector<std::byte> encode_tile(const TileMesh& mesh, const TileHeader& header) {
  assert(mesh.v.size() == mesh.size() && mesh.height.size() == mesh.size());
  assert(mesh.normals.empty() || mesh.normals.size() == mesh.size());
  assert(mesh.water.empty() || mesh.water.size() == 1 || mesh.water.size() == kWaterCells);
  Writer out;
  out.put(header.centre);
  out.put(mesh.lowest);
  out.put(mesh.highest);
  out.put(header.sphere.centre);
  out.put(header.sphere.radius);
  out.put(header.horizon_occlusion);

  out.put(static_cast<std::uint32_t>(mesh.size()));
  put_column(out, mesh.u);
  put_column(out, mesh.v);
  put_column(out, mesh.height);

  const TileEdges edges = edges_of(mesh);
  if (mesh.size() > kMaxShortVertices) {
    out.align(sizeof(std::uint32_t));
    put_indices<std::uint32_t>(out, mesh, edges);
  } else {
    put_indices<std::uint16_t>(out, mesh, edges);
  }

  if (!mesh.normals.empty()) {
    put_extension(out, TileExtension::oct_normals, 2 * mesh.size());
    for (const auto& normal : mesh.normals) out.put(oct_encode(normal));
  }
  if (!mesh.water.empty()) {
    put_extension(out, TileExtension::water_mask, mesh.water.size());
    for (const std::uint8_t cell : mesh.water) out.put(cell);
  }
  if (!mesh.metadata.empty()) {
    put_extension(out, TileExtension::metadata, mesh.metadata.size() + sizeof(std::uint32_t));
    out.put(static_cast<std::uint32_t>(mesh.metadata.size()));
    for (const char c : mesh.metadata) out.put(c);
  }
  return out.take();
}

}  // namespace terrace::terrain
