// SPDX-License-Identifier: Apache-2.0
// Applies operations to points of a lattice of 6 x 6 x 5, so that ties, duplicates and flat states
// are frequent. After each one the triangulation must be valid and equal to a rebuild.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "delaunay3/access.hpp"

namespace {

using namespace terrace::tri;

template <class Coord>
void check(const Delaunay3<Coord>& triangulation) {
  std::string fault = find_fault(triangulation);
  std::vector<std::array<Coord, 3>> points;
  for (const VertexId v : triangulation.all_vertices()) points.push_back(triangulation.point(v));
  std::reverse(points.begin(), points.end());
  Delaunay3<Coord> other;
  other.build(points);
  if (fault.empty() && other.hash() != triangulation.hash()) fault = "differs from a rebuild";
  if (fault.empty()) return;
  std::fprintf(stderr, "%s\n", fault.c_str());
  std::abort();
}

// Each operation is one byte for its kind and count, then one byte per operand.
template <class Coord>
void run(const std::uint8_t* data, std::size_t size) {
  Delaunay3<Coord> triangulation;
  std::size_t at = 0;
  const auto next = [&] { return at < size ? data[at++] : std::uint8_t{0}; };
  const auto next_point = [&] {
    const std::uint8_t cell = next();
    return std::array<Coord, 3>{static_cast<Coord>(cell % 6), static_cast<Coord>(cell / 6 % 6),
                                static_cast<Coord>(cell / 36 % 5)};
  };
  while (at < size) {
    const std::uint8_t head = next();
    const std::size_t count = 1 + head / 4 % 16;
    if (head % 4 < 2) {
      std::vector<std::array<Coord, 3>> points;
      for (std::size_t i = 0; i < count; ++i) points.push_back(next_point());
      if (head % 4 == 0 && triangulation.vertex_count() == 0) {
        triangulation.build(points);
      } else if (head % 4 == 0) {
        triangulation.insert(points, {});
      } else {
        for (const auto& point : points) triangulation.insert(point);
      }
    } else {
      std::vector<VertexId> vertices;
      for (const VertexId v : triangulation.all_vertices()) vertices.push_back(v);
      std::vector<VertexId> chosen;
      for (std::size_t i = 0; i < count && !vertices.empty(); ++i) {
        const std::size_t k = next() % vertices.size();
        chosen.push_back(vertices[k]);
        vertices.erase(vertices.begin() + static_cast<std::ptrdiff_t>(k));
      }
      if (head % 4 == 2) {
        triangulation.remove(std::span<const VertexId>(chosen));
      } else {
        for (const VertexId v : chosen) triangulation.remove(v);
      }
    }
    check(triangulation);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  run<std::int32_t>(data, size);
  run<double>(data, size);
  return 0;
}
