// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <utility>

#include "mesh.hpp"

/// Inserts a vertex into a Delaunay triangulation: replaces the triangles whose circles contain it
/// by triangles of the vertex and the sides of the hole (A. Bowyer, D. F. Watson, 1981).

namespace terrace::tri::tin {

class Cavity {
 public:
  /// Collects the triangles to remove: `first`, which contains the new vertex, and those reachable
  /// from it for which `inside(triangle)` holds (its circle strictly contains the vertex).
  template <class Inside>
  void dig(const Triangles& triangles, std::uint32_t first, const Inside& inside) {
    edges_.clear();
    removed_.assign(1, first);
    stack_.assign({{first, 2}, {first, 1}, {first, 0}});
    while (!stack_.empty()) {
      const auto [t, side] = stack_.back();
      stack_.pop_back();
      const std::uint32_t across = triangles[t].next[side];
      const unsigned back = across == kNone ? 0 : side_to(triangles[across], t);
      if (across != kNone && inside(triangles[across])) {
        removed_.push_back(across);
        stack_.push_back({across, before(back)});
        stack_.push_back({across, after(back)});
      } else {
        edges_.push_back(
            {triangles[t].corner[after(side)], triangles[t].corner[before(side)], across, back});
      }
    }
  }

  /// Fills the hole with the triangles of `vertex` and its sides. `flat(a, b)`: true for a side on
  /// the hull if the vertex is on it; such a side is split in two. The new triangles have the
  /// vertex as corner 0; their `place` and `error` are 0.
  template <class Flat>
  void fill(Triangles& triangles, std::uint32_t vertex, const Flat& flat) {
    bool open = false;
    for (std::size_t i = 0; i < edges_.size() && !open; ++i) {
      if (edges_[i].outer != kNone || !flat(edges_[i].a, edges_[i].b)) continue;
      open = true;  // the other sides are a chain that starts after it
      turned_.assign(edges_.begin() + static_cast<std::ptrdiff_t>(i) + 1, edges_.end());
      turned_.insert(turned_.end(), edges_.begin(),
                     edges_.begin() + static_cast<std::ptrdiff_t>(i));
      std::swap(edges_, turned_);
    }
    const std::size_t count = edges_.size();
    assert(count >= removed_.size());
    created_ = removed_;
    while (created_.size() < count) {
      created_.push_back(static_cast<std::uint32_t>(triangles.size()));
      triangles.emplace_back();
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Edge& edge = edges_[i];
      const std::uint32_t following = i + 1 < count ? created_[i + 1] : open ? kNone : created_[0];
      const std::uint32_t preceding = i > 0 ? created_[i - 1] : open ? kNone : created_[count - 1];
      triangles[created_[i]] = {
          {vertex, edge.a, edge.b}, {edge.outer, following, preceding}, 0, 0.0F};
      if (edge.outer != kNone) triangles[edge.outer].next[edge.back] = created_[i];
    }
  }

  /// The triangles made by fill(), which reuse all slots of the removed ones.
  const std::vector<std::uint32_t>& created() const { return created_; }

 private:
  struct Edge {
    std::uint32_t a, b;   ///< along the hole, counter-clockwise
    std::uint32_t outer;  ///< the triangle beyond, or kNone
    unsigned back;        ///< the side of `outer` towards the hole
  };
  std::vector<Edge> edges_, turned_;
  std::vector<std::uint32_t> removed_, created_;
  std::vector<std::pair<std::uint32_t, unsigned>> stack_;
};

}  // namespace terrace::tri::tin
