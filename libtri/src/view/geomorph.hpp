// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <tuple>
#include <vector>

#include <terrace/base/union_find.hpp>

#include "patches.hpp"
#include "terrace/tri/geomorph.hpp"

/// Implements the template of geomorph.hpp, for files that instantiate it.

namespace terrace::tri {
namespace detail {

/// Marks the cells of the plane that contain a place, to reject triangles without one quickly.
class PlaceMask {
 public:
  void clear() { places_.clear(); }
  void add(const Point3& place) { places_.push_back({place[0], place[1]}); }
  void build() {
    cells_.assign(kCells * kCells, false);
    low_ = {kFar, kFar};
    std::array<double, 2> high{-kFar, -kFar};
    for (const auto& place : places_) {
      for (std::size_t k = 0; k < 2; ++k) {
        low_[k] = std::min(low_[k], place[k]);
        high[k] = std::max(high[k], place[k]);
      }
    }
    for (std::size_t k = 0; k < 2; ++k) {
      per_unit_[k] = high[k] > low_[k] ? kCells / (high[k] - low_[k]) : 0.0;
    }
    for (const auto& place : places_) cells_[cell(place, 1) * kCells + cell(place, 0)] = true;
  }
  /// False only if no place is in the triangle.
  [[nodiscard]] bool meets(const Point3& a, const Point3& b, const Point3& c) const {
    std::array<std::size_t, 2> first{}, last{};
    for (std::size_t k = 0; k < 2; ++k) {
      first[k] = cell({std::min({a[0], b[0], c[0]}), std::min({a[1], b[1], c[1]})}, k);
      last[k] = cell({std::max({a[0], b[0], c[0]}), std::max({a[1], b[1], c[1]})}, k);
    }
    for (std::size_t y = first[1]; y <= last[1]; ++y) {
      for (std::size_t x = first[0]; x <= last[0]; ++x) {
        if (cells_[y * kCells + x]) return true;
      }
    }
    return false;
  }

 private:
  static constexpr std::size_t kCells = 64;
  static constexpr double kFar = std::numeric_limits<double>::max();

  [[nodiscard]] std::size_t cell(const std::array<double, 2>& place, std::size_t k) const {
    const double at = (place[k] - low_[k]) * per_unit_[k];
    return at > 0.0 ? std::min(static_cast<std::size_t>(std::min(at, double{kCells})), kCells - 1)
                    : 0;
  }

  std::vector<std::array<double, 2>> places_;
  std::vector<bool> cells_;
  std::array<double, 2> low_{}, per_unit_{};
};

template <class Coord>
Point3 place_of(const std::array<Coord, 2>& point, double height) {
  return {static_cast<double>(point[0]), static_cast<double>(point[1]), height};
}
template <class Coord>
Point3 place_of(const std::array<Coord, 3>& point, double = 0.0) {
  return {static_cast<double>(point[0]), static_cast<double>(point[1]),
          static_cast<double>(point[2])};
}

}  // namespace detail

/// A step as triangles before and after. Their vertices are numbered. Removed vertices come first,
/// as other vertices may use their slots by now.
template <class Triangulation>
struct Geomorph<Triangulation>::Scratch {
  using Delta = typename Model::Delta;
  using Triangle = std::array<std::uint32_t, 3>;
  static constexpr std::size_t kAxes = std::tuple_size_v<typename Triangulation::Point>;
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  struct Site {
    VertexId vertex;
    Point3 old_place, new_place;
    std::uint32_t lost = 0, gained = 0;  ///< number of triangles
  };
  std::vector<std::uint32_t> number;  ///< number of a site, by vertex slot. kNone between calls
  std::vector<Site> sites;
  std::size_t removed_count = 0;  ///< number of sites that were removed
  std::vector<Triangle> old_triangles, new_triangles;
  std::vector<std::uint32_t> part;  ///< part of each site
  Patches<kAxes> patches;
  detail::PlaceMask mask;
  struct Mover {
    Point3 place;
    std::uint32_t part, index;  ///< index: number of a site or an anchor
    std::uint32_t on = kNone;   ///< the triangle on which it ends
  };
  std::vector<Mover> movers;
  std::vector<std::uint32_t> order;  ///< the triangles of `patches`
  std::vector<std::uint32_t> index;  ///< index in `old_triangles`, by slot. kNone between calls

  std::uint32_t site(const Model& model, VertexId vertex) {
    std::uint32_t& n = number[slot(vertex)];
    if (n == kNone) {
      n = static_cast<std::uint32_t>(sites.size());
      double height = 0.0;
      if constexpr (kAxes == 2) height = model.height(vertex);
      const Point3 place = detail::place_of(model.triangulation().point(vertex), height);
      sites.push_back({vertex, place, place});
    }
    return n;
  }
  void read(const Model& model, const Delta& delta) {
    const Triangulation& triangulation = model.triangulation();
    const auto& changes = delta.changes;
    number.resize(std::max<std::size_t>(number.size(), triangulation.vertex_slots()), kNone);
    sites.clear();
    old_triangles.clear();
    new_triangles.clear();
    removed_count = changes.removed_vertices.size();
    for (std::size_t i = 0; i < removed_count; ++i) {
      const Point3 place =
          detail::place_of(changes.removed_points[i], kAxes == 2 ? delta.removed_heights[i] : 0.0);
      number[slot(changes.removed_vertices[i])] = static_cast<std::uint32_t>(i);
      sites.push_back({changes.removed_vertices[i], place, place});
    }
    const auto add = [&](std::vector<Triangle>& to, const std::array<VertexId, 3>& corners,
                         std::uint32_t Site::*count) {
      Triangle triangle;
      for (std::size_t i = 0; i < 3; ++i) {
        triangle[i] = site(model, corners[i]);
        ++(sites[triangle[i]].*count);
      }
      to.push_back(triangle);
    };
    for (const auto& corners : changes.removed_corners) add(old_triangles, corners, &Site::lost);
    for (const VertexId vertex : changes.removed_vertices) number[slot(vertex)] = kNone;
    for (const TriangleId t : changes.added_triangles) {
      add(new_triangles, triangulation.vertices(t), &Site::gained);
    }
    for (std::size_t i = 0; i < delta.reassigned.size(); ++i) {
      Point3& place = sites[site(model, delta.reassigned[i])].old_place;
      if constexpr (kAxes == 2) place[2] = delta.reassigned_heights[i];
    }
    for (const VertexId vertex : changes.added_vertices) site(model, vertex);
  }
  /// Determines the connected parts and returns their number.
  std::size_t find_parts() {
    base::UnionFind sets(sites.size());
    for (const auto* triangles : {&old_triangles, &new_triangles}) {
      for (const auto& [a, b, c] : *triangles) {
        sets.unite(a, b);
        sets.unite(a, c);
      }
    }
    part.assign(sites.size(), 0);
    std::uint32_t count = 0;
    // The root of a set is its least number.
    for (std::uint32_t n = 0; n < sites.size(); ++n) {
      const std::uint32_t root = sets.find(n);
      part[n] = root == n ? count++ : part[root];
    }
    return count;
  }
  void reset_numbers() {
    for (std::size_t i = removed_count; i < sites.size(); ++i)
      number[slot(sites[i].vertex)] = kNone;
  }

  /// Turns the anchors on removed triangles into movers.
  void find_anchors(std::span<const TriangleId> removed, std::span<Anchor> anchors) {
    if (anchors.empty()) return;
    for (std::uint32_t i = 0; i < removed.size(); ++i) {
      index.resize(std::max<std::size_t>(index.size(), slot(removed[i]) + 1), kNone);
      index[slot(removed[i])] = i;
    }
    for (std::uint32_t i = 0; i < anchors.size(); ++i) {
      Anchor& anchor = anchors[i];
      anchor.moved = anchor.on != kNoTriangle && slot(anchor.on) < index.size() &&
                     index[slot(anchor.on)] != kNone;
      if (!anchor.moved) continue;
      movers.push_back({anchor.place, part[old_triangles[index[slot(anchor.on)]][0]], i});
    }
    for (const TriangleId t : removed) index[slot(t)] = kNone;
  }
  /// Moves the movers onto the surface with the triangles `onto`, whose sites are at `at`.
  void project(std::size_t part_count, const std::vector<Triangle>& onto, Point3 Site::*at) {
    if (movers.empty()) return;
    patches.clear();
    order.clear();
    if constexpr (kAxes == 2) {
      mask.clear();
      for (const Mover& mover : movers) mask.add(mover.place);
      mask.build();
    }
    for (std::uint32_t t = 0; t < onto.size(); ++t) {
      const auto& [i, j, k] = onto[t];
      const Point3 &a = sites[i].*at, &b = sites[j].*at, &c = sites[k].*at;
      if constexpr (kAxes == 2) {
        if (!mask.meets(a, b, c)) continue;
      }
      patches.add(kAxes == 2 ? 0 : part[i], a, b, c);
      order.push_back(t);
    }
    patches.build(kAxes == 2 ? 1 : part_count);
    for (Mover& mover : movers) {
      const auto hit = patches.find(kAxes == 2 ? 0 : mover.part, mover.place);
      if (!hit) continue;
      mover.place = hit->place;
      mover.on = order[hit->triangle];
    }
  }
};

template <class Triangulation>
Geomorph<Triangulation>::Geomorph() : scratch_(std::make_unique<Scratch>()) {}
template <class Triangulation>
Geomorph<Triangulation>::~Geomorph() = default;

template <class Triangulation>
void Geomorph<Triangulation>::make(const Model& model, const typename Model::Delta& delta,
                                   bool with_removed, std::span<Anchor> anchors) {
  constexpr bool plane = Scratch::kAxes == 2;
  using Site = typename Scratch::Site;
  const auto& changes = delta.changes;
  if (plane && (delta.removed_heights.size() != changes.removed_vertices.size() ||
                delta.reassigned_heights.size() != delta.reassigned.size())) {
    throw std::invalid_argument(
        "geomorph: the delta has no old heights; make the model with old_heights");
  }
  added.clear();
  removed.clear();
  reassigned.clear();
  Scratch& s = *scratch_;
  s.read(model, delta);
  if constexpr (plane) {
    for (const VertexId vertex : delta.reassigned) {
      const Site& site = s.sites[s.number[slot(vertex)]];
      reassigned.add(vertex, site.old_place, site.new_place);
    }
  }
  parts = {};
  removed_on.clear();
  const std::size_t count = !plane || with_removed || !anchors.empty() ? s.find_parts() : 0;
  if (with_removed) {
    parts.count = count;
    for (const auto& corners : s.old_triangles)
      parts.removed_triangles.push_back(s.part[corners[0]]);
    for (const auto& corners : s.new_triangles) parts.added_triangles.push_back(s.part[corners[0]]);
  }

  const auto mover = [&](std::uint32_t n, Point3 Site::*at) {
    s.movers.push_back({s.sites[n].*at, count > 0 ? s.part[n] : 0, n});
  };
  s.movers.clear();
  if constexpr (plane) {
    for (const VertexId v : changes.added_vertices) mover(s.number[slot(v)], &Site::new_place);
  } else {
    for (auto n = static_cast<std::uint32_t>(s.removed_count); n < s.sites.size(); ++n) {
      const Site& site = s.sites[n];
      const bool is_added = site.gained > 0 && site.lost == 0 &&
                            site.gained == model.triangulation().triangles_at(site.vertex);
      if (is_added) mover(n, &Site::new_place);
    }
  }
  s.project(count, s.old_triangles, &Site::old_place);
  for (const auto& m : s.movers) {
    added.add(s.sites[m.index].vertex, m.place, s.sites[m.index].new_place);
    if (with_removed) parts.added.push_back(m.part);
  }

  s.movers.clear();
  for (std::uint32_t n = 0; with_removed && n < s.sites.size(); ++n) {
    const Site& site = s.sites[n];
    bool is_removed = n < s.removed_count;
    if constexpr (!plane) {
      is_removed =
          site.lost > 0 && (is_removed || model.triangulation().triangles_at(site.vertex) == 0);
    }
    if (is_removed) mover(n, &Site::old_place);
  }
  const std::size_t removed_movers = s.movers.size();
  s.find_anchors(changes.removed_triangles, anchors);
  s.project(count, s.new_triangles, &Site::new_place);
  for (std::size_t i = 0; i < s.movers.size(); ++i) {
    const auto& m = s.movers[i];
    const TriangleId on = m.on == Scratch::kNone ? kNoTriangle : changes.added_triangles[m.on];
    if (i < removed_movers) {
      removed.add(s.sites[m.index].vertex, s.sites[m.index].old_place, m.place);
      removed_on.push_back(on);
      parts.removed.push_back(m.part);
    } else {
      anchors[m.index].end = m.place;
      anchors[m.index].on = on;
    }
  }
  s.reset_numbers();
}

}  // namespace terrace::tri
