// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "incidence.hpp"
#include "surface_distance.hpp"
#include "terrace/tri/surface_simplification.hpp"
#include "triangle_distance.hpp"

namespace terrace::tri::shape {

/// Marks the end of a list, a face that was removed, and the missing target of a collapse.
inline constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Throws std::invalid_argument for a surface that has too many faces, or as check_faces() does.
void check_shrinkable(const Surface& surface);

/// A weighted sum of the squared distances from planes, as a function of the point: the quadratic
/// form x' A x + 2 b' x + c. (M. Garland, P. Heckbert, doi:10.1145/258734.258849)
class PlaneQuadric {
 public:
  /// Adds the plane with this unit normal through a point.
  void add(const Vector3& normal, const Vector3& through, double weight) {
    const double offset = -dot(normal, through);
    const std::array<double, 4> plane{normal[0], normal[1], normal[2], offset};
    for (std::size_t i = 0, term = 0; i < 4; ++i) {
      for (std::size_t k = i; k < 4; ++k) terms_[term++] += weight * plane[i] * plane[k];
    }
    weight_ += weight;
  }
  void add(const PlaneQuadric& other) {
    for (std::size_t i = 0; i < terms_.size(); ++i) terms_[i] += other.terms_[i];
    weight_ += other.weight_;
  }

  /// The root of the weighted mean of the squared distances; 0 without planes.
  [[nodiscard]] double distance(const Vector3& p) const {
    if (!(weight_ > 0.0)) return 0.0;
    const auto& [xx, xy, xz, xw, yy, yz, yw, zz, zw, ww] = terms_;
    const double sum = xx * p[0] * p[0] + yy * p[1] * p[1] + zz * p[2] * p[2] +
                       2.0 * (xy * p[0] * p[1] + xz * p[0] * p[2] + yz * p[1] * p[2]) +
                       2.0 * (xw * p[0] + yw * p[1] + zw * p[2]) + ww;
    return sum > 0.0 ? std::sqrt(sum / weight_) : 0.0;
  }

 private:
  std::array<double, 10> terms_{};  ///< the upper triangle of the symmetric 4 x 4 matrix, by rows
  double weight_ = 0.0;
};

/// A shrinking surface, in local coordinates (SurfaceFrame). The faces at a vertex are a
/// ring of corners (corner 3 f + k is corner k of face f), so that two vertices are joined by
/// joining their rings. Corners of removed faces are taken out of a ring when it is next walked.
class ShrinkingSurface {
  using Face = std::array<std::uint32_t, 3>;

 public:
  ShrinkingSurface(const Surface& surface, const SurfaceFrame& frame);

  /// A collapse of a vertex onto a neighbour. cost: an estimate of the error, infinity if there is
  /// no allowed collapse.
  struct Collapse {
    std::uint32_t target = kNone;
    double cost = std::numeric_limits<double>::infinity();
  };
  /// The cheapest allowed collapse of a vertex.
  /// allows(target): whether the vertex may move onto this neighbour.
  template <class Allows>
  [[nodiscard]] Collapse cheapest(std::uint32_t vertex, const Allows& allows);
  /// The error of a collapse: the largest distance between the full surface and the triangles after
  /// it. Measured from the vertex and the removed ones that are nearest to its triangles, and from
  /// about as many places on the changed triangles, nine or more on each. Infinity if that exceeds
  /// `limit` or no triangle remains at the target. If it is at most `enough`, any number from it to
  /// `enough` may be returned, which is much faster.
  [[nodiscard]] double error_after(std::uint32_t vertex, std::uint32_t target, double limit,
                                   double enough);
  /// Performs the collapse that error_after() measured last. Replaces `around` with the
  /// vertices whose triangles changed.
  void collapse(std::uint32_t vertex, std::uint32_t target, std::vector<std::uint32_t>& around);

  [[nodiscard]] bool on_surface(std::uint32_t vertex) const { return ring_[vertex] != kNone; }
  [[nodiscard]] std::size_t vertices() const { return vertices_; }
  /// Replaces `out` with the vertex, if it is on the surface, and its neighbours.
  void with_neighbours(std::uint32_t vertex, std::vector<std::uint32_t>& out);
  [[nodiscard]] SimplifiedSurface result(const Surface& full) const;

 private:
  /// A neighbour of a vertex and the number of triangles that they share.
  struct Neighbour {
    std::uint32_t vertex = 0;
    std::uint32_t triangles = 0;
  };

  template <class Visit>
  void for_each_corner(std::uint32_t vertex, Visit&& visit);
  void neighbours(std::uint32_t vertex, std::vector<Neighbour>& out);
  /// An estimate of the error of a collapse.
  [[nodiscard]] double cost(std::uint32_t vertex, std::uint32_t target) const;
  [[nodiscard]] bool keeps_topology(std::uint32_t vertex, const Neighbour& target);
  [[nodiscard]] bool keeps_orientation(std::uint32_t vertex, std::uint32_t target);
  [[nodiscard]] Vector3 normal(const Face& face) const;
  [[nodiscard]] bool has(std::uint32_t face, std::uint32_t vertex) const {
    const Face& f = faces_[face];
    return f[0] == vertex || f[1] == vertex || f[2] == vertex;
  }
  void add_planes();
  void add_border_planes();
  /// Returns the larger of a distance and the distances of the changed triangles from the full
  /// surface.
  [[nodiscard]] double bulge_after(std::uint32_t vertex, std::uint32_t target, double limit,
                                   double distance);
  [[nodiscard]] double distance_of(std::uint32_t sample, double limit);

  std::vector<Vector3> points_;
  std::vector<Face> faces_;             ///< the first corner of a removed face is kNone
  std::vector<std::uint32_t> next_;     ///< the next corner of the same vertex
  std::vector<std::uint32_t> ring_;     ///< a corner of each vertex, or kNone
  std::vector<PlaneQuadric> quadrics_;  ///< of the triangles that each vertex stands for
  std::vector<std::uint32_t> sample_;   ///< the first removed vertex nearest to each face
  std::vector<std::uint32_t> next_sample_;
  std::size_t vertices_ = 0;
  SurfaceDistance full_;

  // Scratch.
  std::uint32_t near_ = 0;  ///< a face near the last place whose distance was measured
  std::vector<Neighbour> around_, around_target_;
  std::vector<std::pair<double, std::size_t>> costs_;
  std::vector<std::uint32_t> shared_;       ///< vertices opposite to the edge that collapses
  std::vector<std::uint32_t> after_;        ///< faces at the target after the collapse
  std::vector<TriangleDistance> measures_;  ///< one for each of them
  std::vector<std::pair<std::uint32_t, std::uint32_t>> moves_;  ///< samples and their new faces
};

template <class Allows>
ShrinkingSurface::Collapse ShrinkingSurface::cheapest(std::uint32_t vertex, const Allows& allows) {
  neighbours(vertex, around_);
  const auto overused = [](const Neighbour& n) { return n.triangles > 2; };
  if (std::any_of(around_.begin(), around_.end(), overused)) return {};
  costs_.clear();
  for (std::size_t i = 0; i < around_.size(); ++i) {
    if (allows(around_[i].vertex)) costs_.emplace_back(cost(vertex, around_[i].vertex), i);
  }
  std::sort(costs_.begin(), costs_.end());
  for (const auto& [cost, i] : costs_) {
    const Neighbour target = around_[i];
    if (keeps_orientation(vertex, target.vertex) && keeps_topology(vertex, target)) {
      return {target.vertex, cost};
    }
  }
  return {};
}

}  // namespace terrace::tri::shape
