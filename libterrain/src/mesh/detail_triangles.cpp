// SPDX-License-Identifier: Apache-2.0
#include "mesh/detail_triangles.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "mesh/wanted_entities.hpp"

namespace terrace::terrain {
namespace {

/// Three corners, their places in order, and the mesh.
constexpr std::size_t kBytesPerTriangle = 3 * (24 + 4 + 4 + 24) + 12;

/// Makes one vertex of corners that are equal to the last bit, numbered as they first appear.
TriangleMesh welded(std::vector<stream::Point3> corners) {
  const auto bits = [&](std::uint32_t i) {
    return std::bit_cast<std::array<std::uint64_t, 3>>(corners[i]);
  };
  std::vector<std::uint32_t> order(corners.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const auto x = bits(a), y = bits(b);
    return x < y || (x == y && a < b);
  });
  std::vector<std::uint32_t> first(corners.size());  // the first corner that is equal to each
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && bits(order[i]) == bits(order[i - 1]);
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  order = {};

  TriangleMesh mesh;
  std::vector<std::uint32_t>& number = first;  // in place: each refers to itself or further back
  for (std::uint32_t i = 0; i < corners.size(); ++i) {
    if (first[i] == i) {
      number[i] = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.push_back(corners[i]);
    } else {
      number[i] = number[first[i]];
    }
  }
  mesh.triangles.reserve(corners.size() / 3);
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    mesh.triangles.push_back({number[i], number[i + 1], number[i + 2]});
  }
  return mesh;
}

}  // namespace

TriangleMesh detail_triangles(const stream::Store& store, const Detail& detail,
                              std::uint64_t memory_bytes) {
  std::vector<stream::Point3> corners;
  for_each_wanted_entity(store, detail, memory_bytes, kBytesPerTriangle,
                         [&](std::span<const std::byte>, std::span<const stream::Point3> triangle) {
                           corners.insert(corners.end(), triangle.begin(), triangle.end());
                         });
  return welded(std::move(corners));
}

}  // namespace terrace::terrain
