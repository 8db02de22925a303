// SPDX-License-Identifier: Apache-2.0
#include "shrinking_surface.hpp"

#include <stdexcept>
#include <string>

namespace terrace::tri::shape {
namespace {

/// A collapse may not turn a triangle by more than the angle with this cosine.
constexpr double kLeastTurnCosine = 0.2;
/// Part of an edge's length that is added to the cost of its collapse, so that of equal costs the
/// shortest edge goes first.
constexpr double kLengthShare = 1e-3;
/// Weight of the planes that keep the border in place, relative to the triangles'.
constexpr double kBorderWeight = 10.0;
/// Least number of parts into which a triangle's sides are divided to measure its distance from the
/// full surface.
constexpr std::uint32_t kLeastParts = 4;

}  // namespace

void check_shrinkable(const Surface& surface) {
  if (surface.faces.size() >= (std::size_t{1} << 31) / 3 * 2) {
    throw std::invalid_argument("the surface has " + std::to_string(surface.faces.size()) +
                                " faces, more than can be simplified at once");
  }
  check_faces(surface);
}

/// Returns the points in local coordinates.
static std::vector<Vector3> local_points(const Surface& surface, const SurfaceFrame& frame) {
  std::vector<Vector3> points;
  points.reserve(surface.points.size());
  for (const Point3& p : surface.points) points.push_back(frame.local(p));
  return points;
}

ShrinkingSurface::ShrinkingSurface(const Surface& surface, const SurfaceFrame& frame)
    : points_(local_points(surface, frame)),
      faces_(surface.faces),
      next_(3 * surface.faces.size()),
      ring_(surface.points.size(), kNone),
      quadrics_(surface.points.size()),
      sample_(surface.faces.size(), kNone),
      next_sample_(surface.points.size(), kNone),
      full_(points_, faces_) {
  for (std::uint32_t c = 0; c < next_.size(); ++c) {
    const std::uint32_t v = faces_[c / 3][c % 3];
    if (ring_[v] == kNone) {
      ring_[v] = next_[c] = c;
      ++vertices_;
    } else {
      next_[c] = std::exchange(next_[ring_[v]], c);
    }
  }
  add_planes();
  add_border_planes();
}

/// Calls visit(corner) for the corners of existing faces at a vertex, and takes the others out of
/// its ring.
template <class Visit>
void ShrinkingSurface::for_each_corner(std::uint32_t vertex, Visit&& visit) {
  if (ring_[vertex] == kNone) return;
  std::uint32_t before = ring_[vertex];
  // The ring's entry must exist to mark the end of the walk.
  while (faces_[next_[before] / 3][0] == kNone) {
    if (next_[before] == before) {
      ring_[vertex] = kNone;
      return;
    }
    next_[before] = next_[next_[before]];
  }
  const std::uint32_t end = next_[before];
  ring_[vertex] = end;
  before = end;
  visit(end);
  for (;;) {
    const std::uint32_t corner = next_[before];
    if (corner == end) return;
    if (faces_[corner / 3][0] == kNone) {
      next_[before] = next_[corner];
      continue;
    }
    visit(corner);
    before = corner;
  }
}

/// Replaces `out` with the neighbours in ascending order.
void ShrinkingSurface::neighbours(std::uint32_t vertex, std::vector<Neighbour>& out) {
  out.clear();
  for_each_corner(vertex, [&](std::uint32_t corner) {
    for (const std::uint32_t v : faces_[corner / 3]) {
      if (v != vertex) out.push_back({v, 1});
    }
  });
  std::sort(out.begin(), out.end(),
            [](const Neighbour& a, const Neighbour& b) { return a.vertex < b.vertex; });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (kept > 0 && out[kept - 1].vertex == out[i].vertex) {
      ++out[kept - 1].triangles;
    } else {
      out[kept++] = out[i];
    }
  }
  out.resize(kept);
}

Vector3 ShrinkingSurface::normal(const Face& face) const {
  return cross(minus(points_[face[1]], points_[face[0]]),
               minus(points_[face[2]], points_[face[0]]));
}

void ShrinkingSurface::add_planes() {
  for (const Face& face : faces_) {
    const Vector3 n = normal(face);
    const double length = std::sqrt(dot(n, n));
    if (!(length > 0.0)) continue;
    PlaneQuadric plane;
    plane.add({n[0] / length, n[1] / length, n[2] / length}, points_[face[0]], 0.5 * length);
    for (const std::uint32_t v : face) quadrics_[v].add(plane);
  }
}

/// Adds planes through the edges of the border, perpendicular to their triangles.
void ShrinkingSurface::add_border_planes() {
  for (std::uint32_t v = 0; v < ring_.size(); ++v) {
    neighbours(v, around_);
    for (const Neighbour& neighbour : around_) {
      if (neighbour.triangles != 1 || neighbour.vertex < v) continue;
      for_each_corner(v, [&](std::uint32_t corner) {
        const Face& face = faces_[corner / 3];
        if (!has(corner / 3, neighbour.vertex)) return;
        const Vector3 edge = minus(points_[neighbour.vertex], points_[v]);
        const Vector3 side = cross(edge, normal(face));
        const double length = std::sqrt(dot(side, side));
        if (!(length > 0.0)) return;
        PlaneQuadric plane;
        plane.add({side[0] / length, side[1] / length, side[2] / length}, points_[v],
                  kBorderWeight * dot(edge, edge));
        quadrics_[v].add(plane);
        quadrics_[neighbour.vertex].add(plane);
      });
    }
  }
}

/// Requires that around_ has the neighbours of `vertex`.
bool ShrinkingSurface::keeps_topology(std::uint32_t vertex, const Neighbour& target) {
  neighbours(target.vertex, around_target_);
  shared_.clear();
  for_each_corner(vertex, [&](std::uint32_t corner) {
    if (!has(corner / 3, target.vertex)) return;
    for (const std::uint32_t v : faces_[corner / 3]) {
      if (v != vertex && v != target.vertex) shared_.push_back(v);
    }
  });
  const auto touches_border = [](const Neighbour& n) { return n.triangles == 1; };
  // An edge across the surface between two places of its border would pinch it.
  if (target.triangles > 1 && std::any_of(around_.begin(), around_.end(), touches_border) &&
      std::any_of(around_target_.begin(), around_target_.end(), touches_border)) {
    return false;
  }
  std::size_t common = 0;
  for (std::size_t i = 0, k = 0; i < around_.size() && k < around_target_.size();) {
    if (around_[i].vertex == around_target_[k].vertex) ++common;
    const bool first = around_[i].vertex <= around_target_[k].vertex;
    const bool second = around_target_[k].vertex <= around_[i].vertex;
    i += first ? 1 : 0;
    k += second ? 1 : 0;
  }
  if (common != shared_.size()) return false;
  // A vertex whose triangles all vanish would be lost.
  const auto is_lost = [&](std::uint32_t opposite) {
    bool lost = true;
    for_each_corner(opposite, [&](std::uint32_t corner) {
      lost = lost && has(corner / 3, vertex) && has(corner / 3, target.vertex);
    });
    return lost;
  };
  if (std::any_of(shared_.begin(), shared_.end(), is_lost)) return false;
  // Triangles of both vertices over the same edge would coincide. That edge joins two of the
  // vertices that they share.
  bool coincide = false;
  const auto is_shared = [&](std::uint32_t v) {
    return std::find(shared_.begin(), shared_.end(), v) != shared_.end();
  };
  for_each_corner(vertex, [&](std::uint32_t corner) {
    if (has(corner / 3, target.vertex)) return;
    bool both = true;
    for (const std::uint32_t v : faces_[corner / 3]) both &= v == vertex || is_shared(v);
    coincide |= both;
  });
  return !coincide;
}

bool ShrinkingSurface::keeps_orientation(std::uint32_t vertex, std::uint32_t target) {
  bool kept = true;
  for_each_corner(vertex, [&](std::uint32_t corner) {
    if (!kept || has(corner / 3, target)) return;
    Face face = faces_[corner / 3];
    const Vector3 before = normal(face);
    face[corner % 3] = target;
    const Vector3 after = normal(face);
    const double squares = dot(before, before) * dot(after, after);
    if (dot(before, before) > 0.0) {
      kept = squares > 0.0 && dot(before, after) >= kLeastTurnCosine * std::sqrt(squares);
    }
  });
  return kept;
}

double ShrinkingSurface::cost(std::uint32_t vertex, std::uint32_t target) const {
  const Vector3& place = points_[target];
  const Vector3 edge = minus(place, points_[vertex]);
  return quadrics_[vertex].distance(place) + kLengthShare * std::sqrt(dot(edge, edge));
}

/// Finds the face of after_ that is nearest to a removed vertex and notes it in moves_.
double ShrinkingSurface::distance_of(std::uint32_t sample, double limit) {
  double least = std::numeric_limits<double>::infinity();
  std::uint32_t nearest = kNone;
  for (std::size_t i = 0; i < after_.size(); ++i) {
    const double square = measures_[i].square(points_[sample]);
    if (square < least) {
      least = square;
      nearest = after_[i];
    }
  }
  moves_.emplace_back(sample, nearest);
  const double distance = std::sqrt(least);
  return distance <= limit ? distance : std::numeric_limits<double>::infinity();
}

double ShrinkingSurface::error_after(std::uint32_t vertex, std::uint32_t target, double limit,
                                     double enough) {
  after_.clear();
  measures_.clear();
  moves_.clear();
  for_each_corner(vertex, [&](std::uint32_t corner) {
    if (has(corner / 3, target)) return;
    Face face = faces_[corner / 3];
    face[corner % 3] = target;
    after_.push_back(corner / 3);
    measures_.emplace_back(points_[face[0]], points_[face[1]], points_[face[2]]);
  });
  for_each_corner(target, [&](std::uint32_t corner) {
    const Face& face = faces_[corner / 3];
    if (has(corner / 3, vertex)) return;
    after_.push_back(corner / 3);
    measures_.emplace_back(points_[face[0]], points_[face[1]], points_[face[2]]);
  });
  double largest = distance_of(vertex, limit);
  for_each_corner(vertex, [&](std::uint32_t corner) {
    for (std::uint32_t s = sample_[corner / 3]; s != kNone && largest <= limit;
         s = next_sample_[s]) {
      largest = std::max(largest, distance_of(s, limit));
    }
  });
  if (largest <= limit) {
    largest = bulge_after(vertex, target, limit, std::max(largest, std::min(enough, limit)));
  }
  return largest <= limit ? largest : std::numeric_limits<double>::infinity();
}

double ShrinkingSurface::bulge_after(std::uint32_t vertex, std::uint32_t target, double limit,
                                     double distance) {
  if (after_.empty()) return distance;
  // About as many places as the triangles stand for vertices.
  const double vertices_per_triangle =
      static_cast<double>(moves_.size()) / static_cast<double>(after_.size());
  const auto parts = std::max(
      kLeastParts, static_cast<std::uint32_t>(std::ceil(std::sqrt(2.0 * vertices_per_triangle))));
  double largest = distance;
  for_each_corner(vertex, [&](std::uint32_t corner) {
    if (has(corner / 3, target) || largest > limit) return;
    const Vector3& a = points_[target];
    const Face& face = faces_[corner / 3];
    const Vector3 to_b = minus(points_[face[(corner % 3 + 1) % 3]], a);
    const Vector3 to_c = minus(points_[face[(corner % 3 + 2) % 3]], a);
    // The side from b to c does not change.
    for (std::uint32_t sum = 1; sum < parts; ++sum) {
      for (std::uint32_t i = 0; i <= sum; ++i) {
        const double b = static_cast<double>(sum - i) / parts;
        const double c = static_cast<double>(i) / parts;
        const Vector3 offset{b * to_b[0] + c * to_c[0], b * to_b[1] + c * to_c[1],
                             b * to_b[2] + c * to_c[2]};
        // The target is on the full surface.
        const double square = full_.square({a[0] + offset[0], a[1] + offset[1], a[2] + offset[2]},
                                           dot(offset, offset), largest * largest, near_);
        largest = std::max(largest, std::sqrt(square));
        if (largest > limit) return;
      }
    }
  });
  return largest;
}

void ShrinkingSurface::collapse(std::uint32_t vertex, std::uint32_t target,
                                std::vector<std::uint32_t>& around) {
  for_each_corner(vertex, [&](std::uint32_t corner) {
    sample_[corner / 3] = kNone;
    Face& face = faces_[corner / 3];
    if (has(corner / 3, target)) {
      face[0] = kNone;
    } else {
      face[corner % 3] = target;
    }
  });
  std::swap(next_[ring_[vertex]], next_[ring_[target]]);  // joins two rings
  ring_[vertex] = kNone;
  for (const auto& [sample, face] : moves_) {
    next_sample_[sample] = std::exchange(sample_[face], sample);
  }
  quadrics_[target].add(quadrics_[vertex]);
  --vertices_;
  with_neighbours(target, around);
}

void ShrinkingSurface::with_neighbours(std::uint32_t vertex, std::vector<std::uint32_t>& out) {
  out.clear();
  neighbours(vertex, around_);
  if (on_surface(vertex)) out.push_back(vertex);
  for (const Neighbour& neighbour : around_) out.push_back(neighbour.vertex);
}

SimplifiedSurface ShrinkingSurface::result(const Surface& full) const {
  SimplifiedSurface out;
  std::vector<std::uint32_t> number(points_.size(), kNone);
  for (std::uint32_t v = 0; v < ring_.size(); ++v) {
    if (ring_[v] == kNone) continue;
    number[v] = static_cast<std::uint32_t>(out.input.size());
    out.input.push_back(v);
    out.surface.points.push_back(full.points[v]);
  }
  for (const Face& face : faces_) {
    if (face[0] == kNone) continue;
    out.surface.faces.push_back({number[face[0]], number[face[1]], number[face[2]]});
  }
  return out;
}

}  // namespace terrace::tri::shape
