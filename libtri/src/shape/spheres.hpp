// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "../curve_sort.hpp"
#include "../delaunay3/mesh.hpp"
#include "../pool.hpp"
#include "criterion.hpp"

/// Circumspheres of the tetrahedra and the angles between them, on which the poles rule is based.
///
/// Every number is computed from corners in lexicographic order, by additions, multiplications,
/// divisions and square roots alone. Its bits therefore depend on the coordinates, not on slots,
/// threads or the machine.

namespace terrace::tri::shape {

/// The position of a vertex, scaled by a power of two so that all points fit into a box of side 1.
/// In an elliptical metric it is mapped to where the metric is Euclidean.
struct Place {
  Vector3 at;
  std::uint32_t rank;  ///< rank in lexicographic order; the ghost is last
};
inline constexpr Place kGhostPlace{{}, 0xFFFFFFFFu};

/// The existing vertices in lexicographic order.
template <class Mesh>
std::vector<std::uint32_t> sorted_vertices(const Mesh& mesh) {
  // Sorts by x in integer steps first, then within each step. Uses halves, so that differences do
  // not overflow.
  const auto x = [&](std::uint32_t v) { return static_cast<double>(mesh.vertex[v].point[0]) / 2; };
  std::vector<std::uint32_t> order;
  order.reserve(mesh.vertex.size());
  double min = std::numeric_limits<double>::infinity(), max = -min;
  for (std::uint32_t v = 1; v < mesh.vertex.size(); ++v) {
    if (!mesh.vertex_alive(v)) continue;
    order.push_back(v);
    min = std::min(min, x(v));
    max = std::max(max, x(v));
  }
  Pool<CurveEntry> entries;
  entries.resize(static_cast<std::uint32_t>(order.size()));
  for (std::uint32_t i = 0; i < entries.size(); ++i) {
    const double part = max > min ? (x(order[i]) - min) / (max - min) : 0.0;
    entries[i] = {static_cast<std::uint32_t>(part * 0x3FFFFFFFp0), order[i]};
  }
  radix_sort<10, 3>(entries);
  for (std::uint32_t i = 0; i < entries.size(); ++i) order[i] = entries[i].number;
  for (std::uint32_t i = 0, end = 0; i < entries.size(); i = end) {
    while (end < entries.size() && entries[end].key == entries[i].key) ++end;
    if (end - i < 2) continue;
    std::sort(order.begin() + i, order.begin() + end, [&](std::uint32_t a, std::uint32_t b) {
      return spatial::lexicographically_less(mesh.vertex[a].point, mesh.vertex[b].point);
    });
  }
  return order;
}

/// The largest power of two that scales coordinates of this size to at most 1 in absolute value (up
/// to a factor of 2), within the range of normal numbers.
inline double scale_to_one(double size) {
  int exponent = 0;
  std::frexp(size, &exponent);
  return std::ldexp(1.0, std::clamp(-exponent, -1022, 1022));
}

/// The places of vertices given in lexicographic order, with ranks 0, 1 and so on. Requires a scope
/// of the metric.
template <class Mesh>
std::vector<Place> places_of(const Mesh& mesh, std::span<const std::uint32_t> sorted) {
  std::vector<Place> places(sorted.size());
  double size = 0.0;
  for (std::uint32_t i = 0; i < sorted.size(); ++i) {
    places[i] = {to_doubles(mesh.vertex[sorted[i]].point), i};
    size = std::max(size, largest(places[i].at));
  }
  // Scales first so that differences cannot overflow, then once more for points that are close
  // together.
  const auto rescale = [&](double by) {
    for (Place& place : places)
      for (double& c : place.at) c *= by;
  };
  rescale(scale_to_one(size));
  if (places.empty()) return places;
  const Vector3 origin = places.front().at;
  size = 0.0;
  for (Place& place : places) {
    if constexpr (is_elliptical<Mesh>) place.at = edge(mesh, origin, place.at);
    size = std::max(size, largest(minus(place.at, places.front().at)));
  }
  rescale(scale_to_one(size));
  return places;
}

/// The places of all vertices, by slot.
template <class Mesh>
std::vector<Place> places_of(const Mesh& mesh) {
  const std::vector<std::uint32_t> sorted = sorted_vertices(mesh);
  const std::vector<Place> in_order = places_of(mesh, sorted);
  std::vector<Place> places(mesh.vertex.size(), kGhostPlace);
  for (std::size_t i = 0; i < sorted.size(); ++i) places[sorted[i]] = in_order[i];
  return places;
}

/// A permutation of a tetrahedron's corners that keeps its orientation and moves the two
/// lexicographically first corners to the front, in order.
struct Turn {
  std::array<std::uint8_t, 4> from;  ///< old index of the corner at each new index
  std::array<std::uint8_t, 4> to;    ///< new index of the corner at each old index
};
/// Turns by the old index of the first corner, times 4, plus the old index of the second.
inline constexpr std::array<Turn, 16> kTurns = [] {
  std::array<Turn, 16> turns{};
  for (std::uint8_t first = 0; first < 4; ++first) {
    for (std::uint8_t second = 0; second < 4; ++second) {
      if (second == first) continue;
      Turn& turn = turns[4 * first + second];
      // The facet opposite to the first corner, starting at the second.
      const auto& facet = spatial::kFacet[first];
      const std::size_t at = facet[0] == second ? 0 : facet[1] == second ? 1 : 2;
      turn.from = {first, second, facet[(at + 1) % 3], facet[(at + 2) % 3]};
      for (std::uint8_t i = 0; i < 4; ++i) turn.to[turn.from[i]] = i;
    }
  }
  return turns;
}();

/// The number of the turn in kTurns, which is never 0. rank(vertex): see Place.
template <class Rank>
std::uint8_t turn_of(const std::array<std::uint32_t, 4>& corner, const Rank& rank) {
  // Combines each rank with its index, as such numbers can be sorted without branches, which the
  // processor could not predict.
  std::array<std::uint64_t, 4> key;
  for (std::size_t i = 0; i < 4; ++i) key[i] = std::uint64_t{rank(corner[i])} << 2 | i;
  const std::uint64_t a = std::min(key[0], key[1]), b = std::min(key[2], key[3]);
  const std::uint64_t first = std::min(a, b);
  const std::uint64_t after_first =
      first == a ? std::max(key[0], key[1]) : std::max(key[2], key[3]);
  const std::uint64_t second = std::min(std::max(a, b), after_first);
  return static_cast<std::uint8_t>((first & 3) << 2 | (second & 3));
}

/// Applies a turn to a tetrahedron. new_side(mate): the new number of a neighbour's side.
template <class NewSide>
spatial::Tetrahedron rotate_corners(const spatial::Tetrahedron& t, const Turn& turn,
                                    const NewSide& new_side) {
  spatial::Tetrahedron result;
  for (std::size_t i = 0; i < 4; ++i) {
    result.corner[i] = t.corner[turn.from[i]];
    result.mate[i] = new_side(t.mate[turn.from[i]]);
  }
  return result;
}

/// Turned tetrahedra in the order of their first corners. Neighbours that a bulk build has left far
/// apart in memory are then close together, as the vertices of both are.
struct Renumbered {
  Pool<spatial::Tetrahedron> tetrahedra;
  Pool<std::uint32_t> number;  ///< by slot; undefined for free slots
};
Renumbered in_order_of_vertices(std::span<const spatial::Tetrahedron> tetrahedra,
                                std::span<const Place> places, unsigned threads);

/// The ranks of the corners of a tetrahedron or facet.
using Ranks = std::array<std::uint32_t, 4>;

class Spheres {
 public:
  using Side = spatial::Side;

  /// The tetrahedra must be turned. O(tetrahedra). The result does not depend on the number of
  /// threads.
  Spheres(std::span<const spatial::Tetrahedron> tetrahedra, std::vector<Place> places,
          unsigned threads, const base::StopCheck& check_stop = {});

  [[nodiscard]] std::span<const spatial::Tetrahedron> tetrahedra() const { return tetrahedra_; }
  [[nodiscard]] const std::vector<Place>& places() const { return places_; }
  /// True if the slot holds a finite tetrahedron.
  [[nodiscard]] bool finite(std::uint32_t t) const { return finite_[t] != 0; }
  /// True if the tetrahedron is so flat that rounding decides where its circumcentre is.
  [[nodiscard]] bool flat(std::uint32_t t) const { return std::isnan(sphere_[t].centre[0]); }
  /// The squared circumradius, or NaN if flat.
  [[nodiscard]] double radius2(std::uint32_t t) const {
    return dot(sphere_[t].centre, sphere_[t].centre);
  }
  /// The vector from a vertex of the finite tetrahedron t, given by its place, to its circumcentre.
  [[nodiscard]] Vector3 to_centre(std::uint32_t t, const Vector3& vertex) const {
    const Sphere& s = sphere_[t];
    const Vector3 shift = minus(places_[s.first].at, vertex);
    return {shift[0] + s.centre[0], shift[1] + s.centre[1], shift[2] + s.centre[2]};
  }
  void prefetch(std::uint32_t t) const { __builtin_prefetch(&sphere_[t]); }
  /// The outward unit normal of the hull facet that is this side of a finite tetrahedron.
  [[nodiscard]] Vector3 hull_normal(Side side) const;

  /// 1 - cos of the angle at which the circumspheres on both sides of a facet meet: 0 if they are
  /// the same, 2 if they only touch. Beyond the hull the sphere is a half-space. 1 if one of the
  /// tetrahedra is flat. `side` belongs to a finite tetrahedron.
  [[nodiscard]] double facet_defect(Side side) const;

  [[nodiscard]] Ranks ranks_of(std::uint32_t t) const {
    const auto& corner = tetrahedra_[t].corner;
    Ranks ranks{};
    for (std::size_t i = 0; i < 4; ++i) ranks[i] = places_[corner[i]].rank;
    std::sort(ranks.begin(), ranks.end());
    return ranks;
  }
  /// Three ranks, followed by 0.
  [[nodiscard]] Ranks facet_ranks(Side side) const {
    const auto f =
        spatial::facet_of(tetrahedra_[spatial::tetrahedron_of(side)], spatial::index_of(side));
    Ranks ranks{places_[f[0]].rank, places_[f[1]].rank, places_[f[2]].rank, 0};
    std::sort(ranks.begin(), ranks.begin() + 3);
    return ranks;
  }
  [[nodiscard]] std::size_t bytes() const {
    return places_.capacity() * sizeof(Place) + sphere_.bytes() + finite_.bytes();
  }

 private:
  struct Sphere {
    Vector3 centre;       ///< relative to the first corner, or NaN if flat
    std::uint32_t first;  ///< the first corner
  };
  [[nodiscard]] Sphere sphere_of(const spatial::Tetrahedron& t) const;
  std::span<const spatial::Tetrahedron> tetrahedra_;
  std::vector<Place> places_;  ///< by vertex slot
  // By tetrahedron slot:
  Pool<Sphere> sphere_;        ///< spheres of finite tetrahedra
  Pool<std::uint8_t> finite_;  ///< separate, as it is read everywhere
};

/// 1 - cos of the angle between two vectors, in 0 .. 2, or 1 if rounding leaves no angle.
inline double defect_between(const Vector3& u, const Vector3& v) {
  const double cosine = dot(u, v) / std::sqrt(dot(u, u) * dot(v, v));
  if (std::isnan(cosine)) return 1.0;
  return std::clamp(1.0 - cosine, 0.0, 2.0);
}

}  // namespace terrace::tri::shape
