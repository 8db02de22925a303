// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "model/multiresolution.hpp"
#include "terrace/tri/delaunay2.hpp"
#include "view/control.hpp"

namespace terrace::tri::test {

/// A replacement for a triangulation that is too simple to be wrong. It keeps a set of points and
/// calls any three consecutive ones in lexicographic order a triangle. It rebuilds everything after
/// each change, and makes the journal by comparison with a copy. It separates faults of the model
/// from those of the triangulation.
template <class Coord>
class StandIn {
 public:
  using Point = std::array<Coord, 2>;
  struct Insertion {
    VertexId vertex = kNoVertex;
    bool created = false;
  };
  struct Changes {
    std::vector<VertexId> removed_vertices, added_vertices;
    std::vector<TriangleId> removed_triangles, added_triangles;
  };

  [[nodiscard]] bool alive(VertexId vertex) const {
    return state_.vertices.count(static_cast<std::uint32_t>(vertex)) != 0;
  }
  std::vector<VertexId> build(std::span<const Point> points) {
    std::vector<Insertion> results(points.size());
    insert(points, results, kNoVertex);
    std::vector<VertexId> vertices;
    for (const Insertion& result : results) vertices.push_back(result.vertex);
    return vertices;
  }
  void insert(std::span<const Point> points, std::span<Insertion> results, VertexId) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto found = by_point_.find(points[i]);
      if (found != by_point_.end()) {
        results[i] = {VertexId{found->second}, false};
        continue;
      }
      const std::uint32_t slot = take(free_vertices_, vertex_end_);
      by_point_[points[i]] = slot;
      state_.vertices[slot] = points[i];
      results[i] = {VertexId{slot}, true};
    }
    renew();
  }
  void remove(std::span<const VertexId> vertices) {
    for (const VertexId vertex : vertices) {
      const auto found = state_.vertices.find(static_cast<std::uint32_t>(vertex));
      if (found == state_.vertices.end()) throw std::logic_error("removed twice");
      by_point_.erase(found->second);
      free_vertices_.push_back(found->first);
      state_.vertices.erase(found);
    }
    renew();
  }
  void start_journal() { before_ = state_; }
  void take_changes(Changes& changes) {
    changes = {};
    compare(before_.vertices, state_.vertices, changes.removed_vertices, changes.added_vertices);
    compare(before_.triangles, state_.triangles, changes.removed_triangles,
            changes.added_triangles);
    before_ = state_;
  }

  [[nodiscard]] std::size_t vertex_count() const { return state_.vertices.size(); }
  [[nodiscard]] Point point(VertexId vertex) const {
    return state_.vertices.at(static_cast<std::uint32_t>(vertex));
  }
  [[nodiscard]] std::array<VertexId, 3> vertices(TriangleId triangle) const {
    std::array<VertexId, 3> result;
    const Corners& corners = state_.triangles.at(static_cast<std::uint32_t>(triangle));
    for (std::size_t i = 0; i < 3; ++i) result[i] = VertexId{corners[i].second};
    return result;
  }
  [[nodiscard]] std::vector<VertexId> all_vertices() const {
    std::vector<VertexId> all;
    for (const auto& [slot, point] : state_.vertices) all.push_back(VertexId{slot});
    return all;
  }
  [[nodiscard]] std::vector<TriangleId> all_triangles() const {
    std::vector<TriangleId> all;
    for (const auto& [slot, corners] : state_.triangles) all.push_back(TriangleId{slot});
    return all;
  }
  [[nodiscard]] std::uint64_t hash() const {
    std::uint64_t hash = 1;
    for (const auto& [point, slot] : by_point_) {
      for (const Coord c : point) {
        hash = (hash ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(c))) * 0x100000001B3u;
      }
    }
    return hash;
  }

 private:
  // Includes the slots, so a point that comes back in another slot makes other triangles.
  using Corner = std::pair<Point, std::uint32_t>;
  using Corners = std::array<Corner, 3>;
  struct State {
    std::map<std::uint32_t, Point> vertices;
    std::map<std::uint32_t, Corners> triangles;
  };

  static std::uint32_t take(std::vector<std::uint32_t>& free, std::uint32_t& end) {
    if (free.empty()) return end++;
    const std::uint32_t slot = free.back();
    free.pop_back();
    return slot;
  }
  template <class Value, class Id>
  static void compare(const std::map<std::uint32_t, Value>& before,
                      const std::map<std::uint32_t, Value>& after, std::vector<Id>& removed,
                      std::vector<Id>& added) {
    const auto same = [](const auto& map, const auto& entry) {
      const auto found = map.find(entry.first);
      return found != map.end() && found->second == entry.second;
    };
    for (const auto& entry : before) {
      if (!same(after, entry)) removed.push_back(Id{entry.first});
    }
    for (const auto& entry : after) {
      if (!same(before, entry)) added.push_back(Id{entry.first});
    }
  }
  void renew() {
    std::map<Corners, bool> wanted;
    const std::vector<Corner> sorted(by_point_.begin(), by_point_.end());
    for (std::size_t i = 2; i < sorted.size(); ++i) {
      wanted[{sorted[i - 2], sorted[i - 1], sorted[i]}] = true;
    }
    for (auto it = state_.triangles.begin(); it != state_.triangles.end();) {
      if (wanted.erase(it->second)) {
        ++it;
      } else {
        free_triangles_.push_back(it->first);
        it = state_.triangles.erase(it);
      }
    }
    for (const auto& [corners, unused] : wanted) {
      state_.triangles[take(free_triangles_, triangle_end_)] = corners;
    }
  }

  State state_, before_;
  std::map<Point, std::uint32_t> by_point_;
  std::vector<std::uint32_t> free_vertices_, free_triangles_;
  std::uint32_t vertex_end_ = 1, triangle_end_ = 1;
};

}  // namespace terrace::tri::test
