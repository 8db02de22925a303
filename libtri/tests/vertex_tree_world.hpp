// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "shape/triangle_distance.hpp"
#include "terrace/tri/vertex_tree.hpp"

/// Surfaces and random clusters for tests of vertex trees.

namespace terrace::tri::vertex_trees {

using Face = std::array<std::uint32_t, 3>;
inline constexpr std::uint32_t kNone = VertexClusters::kNone;

/// Adds a bumpy torus or, with `open`, a part of it that is a disc.
inline void add_torus(std::uint32_t around, std::uint32_t across, double shift, bool open,
                      Surface& surface) {
  const auto first = static_cast<std::uint32_t>(surface.points.size());
  const std::uint32_t wide = around - (open ? around / 2 : 0);
  const std::uint32_t high = across - (open ? across / 2 : 0);
  for (std::uint32_t i = 0; i < (open ? wide + 1 : around); ++i) {
    for (std::uint32_t k = 0; k < across; ++k) {
      const double u = 2.0 * std::numbers::pi * i / around, v = 2.0 * std::numbers::pi * k / across;
      const double r = 1.0 + 0.2 * std::sin(3.0 * u) * std::cos(2.0 * v);
      surface.points.push_back({shift + (4.0 + r * std::cos(v)) * std::cos(u),
                                (4.0 + r * std::cos(v)) * std::sin(u), r * std::sin(v)});
    }
  }
  for (std::uint32_t i = 0; i < wide; ++i) {
    for (std::uint32_t k = 0; k < high; ++k) {
      const auto at = [&](std::uint32_t a, std::uint32_t b) {
        return first + (open ? a : a % around) * across + b % across;
      };
      surface.faces.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      surface.faces.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
}

/// Clusters of `size` nearest points around random representatives, level by level, of which a few
/// have a representative that is not on the surface.
inline VertexClusters random_clusters(const Surface& surface, std::size_t size, bool local,
                                      std::mt19937_64& random) {
  VertexClusters out;
  out.leaf.resize(surface.points.size());
  std::vector<std::uint32_t> points(surface.points.size());
  for (std::uint32_t v = 0; v < points.size(); ++v) points[v] = v;
  std::vector<std::uint32_t> below(points.size(), kNone);  // the cluster that each point heads
  for (std::uint8_t level = 0;; ++level) {
    const bool root = points.size() <= 2 * size;
    std::vector<std::uint32_t> heads = points;
    std::shuffle(heads.begin(), heads.end(), random);
    heads.resize(root ? 1 : std::max<std::size_t>(1, points.size() / size));
    const auto first = static_cast<std::uint32_t>(out.clusters.size());
    for (const std::uint32_t head : heads) {
      const bool lost = root || random() % 16 == 0;
      out.clusters.push_back({kNone, lost ? kNone : head, level});
    }
    for (const std::uint32_t v : points) {
      std::size_t nearest = local ? 0 : random() % heads.size();
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t h = 0; h < heads.size(); ++h) {
        const shape::Vector3 d = shape::minus(surface.points[v], surface.points[heads[h]]);
        const double square = shape::dot(d, d);
        if ((local && square < least) || heads[h] == v) {
          least = square;
          nearest = h;
          if (heads[h] == v) break;
        }
      }
      const auto cluster = first + static_cast<std::uint32_t>(nearest);
      if (level == 0) {
        out.leaf[v] = cluster;
      } else {
        out.clusters[below[v]].parent = cluster;
      }
    }
    if (root) return out;
    for (std::size_t h = 0; h < heads.size(); ++h) {
      below[heads[h]] = first + static_cast<std::uint32_t>(h);
    }
    points = heads;
  }
}

}  // namespace terrace::tri::vertex_trees
