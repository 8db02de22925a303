// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include "shape_oracle.hpp"

/// A slow implementation of the poles rule from its definition in shape.hpp. It identifies
/// tetrahedra by their sorted corners, sorts every statement, keeps sets of tetrahedra in maps, and
/// scans everything in each step of the smoothing and the sculpting. It computes numbers from
/// sorted corners as src/shape/spheres.hpp does, so that ties are ties here too.

namespace terrace::tri {

class PolesOracle {
 public:
  enum class Order { kruskal, prim };

  template <class Coord>
  PolesOracle(const Delaunay3<Coord>& triangulation, Order order) {
    for (const TetrahedronId t : triangulation.all_tetrahedra()) {
      const ShapeCorners corners = shape_corners(triangulation, t);
      all_.insert(corners);
      for (std::size_t i = 0; i < 4; ++i) by_facet_[facet(corners, i)].push_back(corners);
      for (const ShapePoint& p : corners) star_[p].push_back(corners);
      centre_[corners] = centre_of(corners);
    }
    add_hull_normals(triangulation);
    make_statements();
    order == Order::kruskal ? label_by_kruskal() : label_by_prim();
    smooth();
    sculpt();
  }

  ShapeSet inside;
  std::set<ShapePoint> missed_vertices;  ///< those that are not on the surface

 private:
  using Facet = std::array<ShapePoint, 3>;
  using Node = std::optional<ShapeCorners>;  ///< nullopt: beyond the hull
  /// The statement that two nodes are on the same side or, if `unlike`, on different sides. Facets
  /// have three corners, vertices one. The order is that of the rule: by defect, then by corners.
  struct Statement {
    double defect;
    std::vector<ShapePoint> corners;
    bool unlike;
    Node one, other;
    bool operator<(const Statement& s) const {
      // A single vertex sorts after all facets that start with it.
      if (defect != s.defect) return defect < s.defect;
      if (corners[0] != s.corners[0]) return corners[0] < s.corners[0];
      if (unlike != s.unlike) return s.unlike;
      return corners < s.corners;
    }
  };

  static ShapePoint minus(const ShapePoint& a, const ShapePoint& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  }
  static double dot(const ShapePoint& a, const ShapePoint& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }
  static ShapePoint cross(const ShapePoint& a, const ShapePoint& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  }
  static Facet facet(const ShapeCorners& t, std::size_t i) {
    Facet result;
    for (std::size_t j = 0, k = 0; j < 4; ++j)
      if (j != i) result[k++] = t[j];
    return result;
  }
  /// Returns the circumcentre relative to the first corner; nullopt if the tetrahedron is flat up
  /// to rounding.
  static std::optional<ShapePoint> centre_of(const ShapeCorners& t) {
    const ShapePoint b = minus(t[1], t[0]), c = minus(t[2], t[0]), d = minus(t[3], t[0]);
    const double volume6 = dot(b, cross(c, d));
    double total = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
      total += std::abs(b[k]) * (std::abs(c[l] * d[m]) + std::abs(c[m] * d[l]));
    }
    if (!(std::abs(volume6) > 0x1p-50 * total)) return std::nullopt;
    ShapePoint result;
    for (std::size_t k = 0; k < 3; ++k)
      result[k] =
          (dot(b, b) * cross(c, d)[k] + dot(c, c) * cross(d, b)[k] + dot(d, d) * cross(b, c)[k]) /
          (2.0 * volume6);
    return result;
  }
  [[nodiscard]] std::optional<ShapePoint> to_centre(const ShapeCorners& t,
                                                    const ShapePoint& from) const {
    const auto& centre = centre_.at(t);
    if (!centre) return std::nullopt;
    const ShapePoint shift = minus(t[0], from);
    return ShapePoint{shift[0] + (*centre)[0], shift[1] + (*centre)[1], shift[2] + (*centre)[2]};
  }
  static double defect(const std::optional<ShapePoint>& u, const std::optional<ShapePoint>& v) {
    if (!u || !v) return 1.0;
    const double cosine = dot(*u, *v) / std::sqrt(dot(*u, *u) * dot(*v, *v));
    return std::isnan(cosine) ? 1.0 : std::max(0.0, std::min(2.0, 1.0 - cosine));
  }
  [[nodiscard]] double defect_of(const Facet& f) const {
    const auto& owners = by_facet_.at(f);
    const std::optional<ShapePoint> u = to_centre(owners[0], f[0]);
    return defect(u, owners.size() == 2 ? to_centre(owners[1], f[0]) : normal_.at(f));
  }

  template <class Coord>
  void add_hull_normals(const Delaunay3<Coord>& triangulation) {
    for (const TetrahedronId t : triangulation.all_tetrahedra()) {
      const ShapeCorners corners = shape_corners(triangulation, t);
      for (std::size_t i = 0; i < 4; ++i) {
        const Facet f = facet(corners, i);
        if (by_facet_.at(f).size() == 2) continue;
        ShapePoint n = cross(minus(f[1], f[0]), minus(f[2], f[0]));
        // Orients the normal outward exactly, from the parity of the permutation to the
        // triangulation's corner order, which is positive.
        std::array<ShapePoint, 4> ordered;
        for (std::size_t k = 0; k < 4; ++k) {
          const auto p = triangulation.point(triangulation.vertices(t)[k]);
          for (std::size_t axis = 0; axis < 3; ++axis)
            ordered[k][axis] = static_cast<double>(p[axis]) + 0.0;
        }
        std::array<ShapePoint, 4> own_corners{f[0], f[1], f[2], corners[i]};
        int swaps = 0;
        for (std::size_t k = 0; k < 4; ++k) {
          const auto at = std::find(own_corners.begin() + static_cast<std::ptrdiff_t>(k),
                                    own_corners.end(), ordered[k]);
          if (at != own_corners.begin() + static_cast<std::ptrdiff_t>(k)) {
            std::iter_swap(at, own_corners.begin() + static_cast<std::ptrdiff_t>(k));
            ++swaps;
          }
        }
        // An even permutation means that the normal points to the fourth corner, that is, inward.
        const double length = std::sqrt(dot(n, n));
        for (double& c : n) c = (swaps % 2 == 0 ? -c : c) / length;
        normal_[f] = n;
      }
    }
  }

  void make_statements() {
    for (const auto& [f, owners] : by_facet_)
      statements_.push_back({defect_of(f),
                             {f.begin(), f.end()},
                             false,
                             owners[0],
                             owners.size() == 2 ? Node(owners[1]) : std::nullopt});
    for (const auto& entry : star_) {
      const auto v = entry.first;
      ShapePoint direction{};
      Node first;
      bool on_hull = false;
      for (const auto& [f, n] : normal_) {
        if (std::find(f.begin(), f.end(), v) == f.end()) continue;
        on_hull = true;
        for (std::size_t k = 0; k < 3; ++k) direction[k] += n[k];
      }
      const auto largest = [&](const auto& allowed) {
        Node best;
        double best2 = -1.0;
        for (const ShapeCorners& t : star_.at(v)) {
          const auto& centre = centre_.at(t);
          if (!centre || !allowed(t)) continue;
          const double r2 = dot(*centre, *centre);
          if (r2 > best2 || (r2 == best2 && t < *best)) best = t, best2 = r2;
        }
        return best;
      };
      if (!on_hull) {
        first = largest([](const ShapeCorners&) { return true; });
        if (!first) continue;
        direction = *to_centre(*first, v);
      }
      const Node second =
          largest([&](const ShapeCorners& t) { return dot(*to_centre(t, v), direction) < 0.0; });
      if (!second) continue;
      ShapePoint second_vector = *to_centre(*second, v);
      for (double& c : second_vector) c = -c;
      statements_.push_back({2.0 * defect(direction, second_vector), {v}, true, first, second});
    }
    std::sort(statements_.begin(), statements_.end());
  }

  void label_by_kruskal() {
    // The number of each node's component, and whether the node is flipped.
    std::map<Node, std::pair<int, bool>> component_of;
    int count = 0;
    component_of[std::nullopt] = {count++, false};
    for (const ShapeCorners& t : all_) component_of[t] = {count++, false};
    for (const Statement& s : statements_) {
      const auto [component_one, flip_one] = component_of.at(s.one);
      const auto [component_other, flip_other] = component_of.at(s.other);
      if (component_one == component_other) continue;
      const bool flip = flip_one != flip_other ? !s.unlike : s.unlike;
      const int from = component_other, to = component_one;
      for (auto& [node, entry] : component_of)
        if (entry.first == from) entry = {to, entry.second != flip};
    }
    for (const ShapeCorners& t : all_)
      if (component_of.at(t).second != component_of.at(std::nullopt).second) inside.insert(t);
  }
  void label_by_prim() {
    std::map<Node, bool> label{{std::nullopt, false}};
    for (bool grown = true; grown;) {
      grown = false;
      for (const Statement& s : statements_) {
        const auto one = label.find(s.one), other = label.find(s.other);
        if ((one == label.end()) == (other == label.end())) continue;
        if (one == label.end()) {
          label[s.one] = other->second != s.unlike;
        } else {
          label[s.other] = one->second != s.unlike;
        }
        grown = true;
        break;
      }
    }
    for (const auto& [node, is_inside] : label)
      if (node && is_inside) inside.insert(*node);
  }

  [[nodiscard]] Node neighbour(const ShapeCorners& t, std::size_t i) const {
    for (const ShapeCorners& other : by_facet_.at(facet(t, i)))
      if (other != t) return other;
    return std::nullopt;
  }
  [[nodiscard]] bool is_inside(const Node& node) const { return node && inside.contains(*node); }
  void flip(const ShapeCorners& t) {
    if (inside.erase(t) == 0) inside.insert(t);
  }
  [[nodiscard]] bool on_hull(const ShapePoint& v) const {
    return std::any_of(normal_.begin(), normal_.end(), [&](const auto& entry) {
      return std::find(entry.first.begin(), entry.first.end(), v) != entry.first.end();
    });
  }
  /// The number of tetrahedra at v that are inside (`label`) or outside. The space beyond the hull
  /// counts as three that are outside.
  [[nodiscard]] std::size_t count(const ShapePoint& v, bool label) const {
    std::size_t result = !label && on_hull(v) ? 3 : 0;
    for (const ShapeCorners& t : star_.at(v)) result += is_inside(t) == label;
    return result;
  }

  void smooth() {
    std::set<ShapeCorners> pending = all_;
    for (;;) {
      std::optional<ShapeCorners> best;
      double best_gain = 0x1p-40;
      for (const ShapeCorners& t : pending) {
        std::vector<double> terms;
        int differing = 0;
        for (std::size_t i = 0; i < 4; ++i) {
          const double weight = 2.0 - defect_of(facet(t, i));
          const bool differs = is_inside(neighbour(t, i)) != is_inside(t);
          differing += differs;
          terms.push_back(differs ? weight : -weight);
        }
        std::sort(terms.begin(), terms.end());
        const double gain = terms[0] + terms[1] + terms[2] + terms[3];
        if (differing >= 2 && gain > best_gain) best = t, best_gain = gain;
      }
      if (!best) break;
      pending.erase(*best);
      const bool label = is_inside(*best);
      if (std::any_of(best->begin(), best->end(),
                      [&](const ShapePoint& v) { return count(v, label) == 1; }))
        continue;
      flip(*best);
      for (std::size_t i = 0; i < 4; ++i)
        if (const Node other = neighbour(*best, i)) pending.insert(*other);
    }
  }
  void sculpt() {
    for (;;) {
      missed_vertices.clear();
      for (const auto& [v, star] : star_)
        if (count(v, false) == 0 || count(v, true) == 0) missed_vertices.insert(v);
      std::optional<std::tuple<double, ShapePoint, Facet, ShapeCorners>> best;
      for (const ShapeCorners& t : all_) {
        for (std::size_t i = 0; i < 4; ++i) {
          if (!missed_vertices.contains(t[i]) || is_inside(neighbour(t, i)) == is_inside(t))
            continue;
          const Facet f = facet(t, i);
          const std::tuple candidate{defect_of(f), t[i], f, t};
          if (!best || candidate < *best) best = candidate;
        }
      }
      if (!best) break;
      flip(std::get<3>(*best));
    }
  }

  ShapeSet all_;
  std::map<Facet, std::vector<ShapeCorners>> by_facet_;
  std::map<ShapePoint, std::vector<ShapeCorners>> star_;
  std::map<ShapeCorners, std::optional<ShapePoint>> centre_;
  std::map<Facet, ShapePoint> normal_;  ///< of the hull, outward
  std::vector<Statement> statements_;
};

}  // namespace terrace::tri
