// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <queue>
#include <vector>

#include "delaunay3/elliptical_kernel.hpp"
#include "delaunay3/predicates.hpp"

/// A copy of tetrahedra that can be flipped. No ghosts: kHullSide lies beyond the hull.

namespace terrace::tri {

class Flips3 {
 public:
  using Vertex = spatial::EllipticalKernel::Vertex;
  using Side = spatial::Side;
  static constexpr Side kHullSide = 0xFFFFFFFFu;
  static constexpr std::uint32_t kNoRegion = 0xFFFFFFFFu;

  // By vertex slot: the point, the number of its region, its place in lexicographic order.
  std::vector<Vertex> vertex;
  std::vector<std::uint32_t> region;
  std::vector<std::uint32_t> rank;
  std::vector<spatial::Tetrahedron> tetrahedron;

  [[nodiscard]] bool alive(std::uint32_t t) const {
    return tetrahedron[t].corner[0] != spatial::kFreeCorner;
  }
  [[nodiscard]] std::uint32_t region_of(std::uint32_t t) const;

  /// Flips what can be flipped among the tetrahedra of a region, in the metric of the scope. `own`:
  /// those tetrahedra at the start. Returns how many facets are stuck.
  std::size_t settle(std::uint32_t number, const std::vector<std::uint32_t>& own);
  [[nodiscard]] std::size_t flip_count() const { return flips_; }

 private:
  using Corners = std::array<std::uint32_t, 4>;
  using Key = std::array<std::uint32_t, 3>;  ///< ranks of a facet's corners, sorted
  struct Pending {
    Key key;
    Side side;
    bool operator<(const Pending& other) const { return other.key < key; }  ///< smallest first
  };

  [[nodiscard]] Key key_of(Side side) const;
  [[nodiscard]] bool is_delaunay(std::uint32_t t, std::uint32_t i) const;
  bool try_flip(std::uint32_t t, std::uint32_t i);
  bool flip_at_edge(std::uint32_t t, std::uint32_t i, std::uint32_t edge, bool coplanar);
  [[nodiscard]] std::uint32_t apex_beyond(std::uint32_t t, std::uint32_t corner) const;
  void replace(std::span<const std::uint32_t> old, std::span<const Corners> fresh);
  std::uint32_t new_slot();

  std::uint32_t number_ = 0;
  std::size_t flips_ = 0;
  std::uint32_t free_ = spatial::kNone;
  std::priority_queue<Pending> pending_;
};

}  // namespace terrace::tri
