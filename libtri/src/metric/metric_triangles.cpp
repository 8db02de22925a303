// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <string>

#include "delaunay2/elliptical_kernel.hpp"
#include "delaunay2/predicates.hpp"
#include "terrace/tri/metric.hpp"

namespace terrace::tri {
namespace {

using namespace planar;

constexpr std::uint32_t kNoRegion = 0xFFFFFFFFu;
constexpr Side kNoSide = 0xFFFFFFFFu;

const LinearMap2& map_of(const Euclidean&) { return kIdentityMap<2>; }
const LinearMap2& map_of(const EllipticalMetric2& metric) { return metric.map(); }

/// A copy of triangles whose edges can be flipped. It has no ghosts: kNoSide stands for the
/// outside.
class Flips {
 public:
  template <class Triangulation>
  Flips(const Triangulation& triangulation, const MetricField2& field,
        const std::optional<Box3>& window)
      : point_(triangulation.vertex_slots()), region_(triangulation.vertex_slots(), kNoRegion) {
    if (!window) triangle_.reserve(triangulation.triangle_count());
    // The dense number of each participating triangle.
    std::vector<std::uint32_t> number(triangulation.triangle_slots(), kNone);
    for (const TriangleId id : triangulation.all_triangles()) {
      const auto corners = triangulation.vertices(id);
      for (const VertexId v : corners) {
        const auto p = triangulation.point(v);
        point_[slot(v)] = {static_cast<double>(p[0]), static_cast<double>(p[1])};
      }
      if (window && !meets(*window, corners)) continue;
      number[slot(id)] = static_cast<std::uint32_t>(triangle_.size());
      triangle_.push_back({{slot(corners[0]), slot(corners[1]), slot(corners[2])}, {}});
    }
    for (const TriangleId id : triangulation.all_triangles()) {
      if (number[slot(id)] == kNone) continue;
      Triangle& t = triangle_[number[slot(id)]];
      const auto beyond = triangulation.neighbours(id);
      for (std::uint32_t i = 0; i < 3; ++i) {
        const std::uint32_t other = beyond[i] == kNoTriangle ? kNone : number[slot(beyond[i])];
        t.mate[i] = kNoSide;
        if (other == kNone) continue;
        // The same edge seen from there: its first corner is this one's second.
        const auto& corner = triangle_[other].corner;
        const auto at = std::find(corner.begin(), corner.end(), t.corner[previous_index(i)]);
        t.mate[i] =
            make_side(other, previous_index(static_cast<std::uint32_t>(at - corner.begin())));
      }
    }
    find_regions(field, map_of(triangulation.metric()));
  }

  void run() {
    // Numbers the triangles region by region.
    std::vector<std::vector<std::uint32_t>> members(maps_.size());
    for (std::uint32_t t = 0; t < triangle_.size(); ++t) {
      const std::uint32_t region = region_of(triangle_[t]);
      if (region != kNoRegion && !done_[region]) members[region].push_back(t);
    }
    for (std::uint32_t region = 0; region < maps_.size(); ++region) {
      if (members[region].empty()) continue;
      const QuadraticForm form(maps_[region]);
      const EllipticalKernel::Scope scope(form);
      for (const std::uint32_t t : members[region]) {
        for (std::uint32_t i = 0; i < 3; ++i) pending_.push_back(make_side(t, i));
        settle(region);
      }
    }
  }

  [[nodiscard]] std::vector<std::array<VertexId, 3>> result() const {
    std::vector<std::array<VertexId, 3>> all;
    all.reserve(triangle_.size());
    for (const Triangle& t : triangle_) {
      std::uint32_t i = 0;
      for (std::uint32_t k = 1; k < 3; ++k)
        if (lexicographically_less(point_[t.corner[k]], point_[t.corner[i]])) i = k;
      all.push_back({VertexId{t.corner[i]}, VertexId{t.corner[next_index(i)]},
                     VertexId{t.corner[previous_index(i)]}});
    }
    return all;
  }

 private:
  using Point = EllipticalKernel::Point;

  [[nodiscard]] bool meets(const Box3& window, const std::array<VertexId, 3>& corners) const {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const auto [least, most] =
          std::minmax({point_[slot(corners[0])][axis], point_[slot(corners[1])][axis],
                       point_[slot(corners[2])][axis]});
      if (!(least <= window.max[axis] && window.min[axis] <= most)) return false;
    }
    return true;
  }

  void find_regions(const MetricField2& field, const LinearMap2& given) {
    std::map<LinearMap2, std::uint32_t> known;
    for (const Triangle& t : triangle_) {
      for (const std::uint32_t v : t.corner) {
        if (region_[v] != kNoRegion) continue;
        const LinearMap2 map = field(point_[v]);
        // Successive vertices mostly share their region.
        if (maps_.empty() || map != maps_[last_]) {
          // Checked before it becomes a key: NaN has no order.
          check_metric(map, "the field of metrics: the map at " + std::to_string(point_[v][0]) +
                                ", " + std::to_string(point_[v][1]));
          const auto [at, fresh] = known.try_emplace(map, static_cast<std::uint32_t>(maps_.size()));
          if (fresh) {
            maps_.push_back(map);
            done_.push_back(map == given);
          }
          last_ = at->second;
        }
        region_[v] = last_;
      }
    }
  }

  [[nodiscard]] std::uint32_t region_of(const Triangle& t) const {
    const std::uint32_t region = region_[t.corner[0]];
    return region_[t.corner[1]] == region && region_[t.corner[2]] == region ? region : kNoRegion;
  }

  /// Flips until no pending side violates the Delaunay condition. Pending sides lie in triangles of
  /// the region; a flip adds those around it.
  void settle(std::uint32_t region) {
    while (!pending_.empty()) {
      const Side side = pending_.back();
      pending_.pop_back();
      const std::uint32_t t = triangle_of(side);
      const std::uint32_t i = index_of(side);
      const Side mate = triangle_[t].mate[i];
      if (mate == kNoSide) continue;
      const std::uint32_t o = triangle_of(mate);
      const std::uint32_t k = index_of(mate);
      // Two of the neighbour's corners are this triangle's.
      if (region_[triangle_[o].corner[k]] != region) continue;
      const auto& [a, b, c] = triangle_[t].corner;
      // A corner inside lies within the angle at the opposite one, so the four are convex.
      if (!inside_circle<EllipticalKernel>(point_[a], point_[b], point_[c],
                                           point_[triangle_[o].corner[k]]))
        continue;
      flip(t, i, o, k);
      for (const std::uint32_t index : {0u, 2u}) {
        pending_.push_back(make_side(t, index));
        pending_.push_back(make_side(o, index));
      }
    }
  }

  /// Replaces the edge between corner i of t and corner k of o by the one that joins these corners,
  /// which becomes side 1 of both.
  void flip(std::uint32_t t, std::uint32_t i, std::uint32_t o, std::uint32_t k) {
    const Triangle one = triangle_[t];
    const Triangle other = triangle_[o];
    const std::uint32_t p = one.corner[i];
    const std::uint32_t a = one.corner[next_index(i)];
    const std::uint32_t b = one.corner[previous_index(i)];
    const std::uint32_t q = other.corner[k];
    triangle_[t].corner = {p, a, q};
    triangle_[o].corner = {q, b, p};
    link(make_side(t, 0), other.mate[next_index(k)]);
    link(make_side(t, 2), one.mate[previous_index(i)]);
    link(make_side(o, 0), one.mate[next_index(i)]);
    link(make_side(o, 2), other.mate[previous_index(k)]);
    link(make_side(t, 1), make_side(o, 1));
  }
  void link(Side inner, Side outer) {
    triangle_[triangle_of(inner)].mate[index_of(inner)] = outer;
    if (outer != kNoSide) triangle_[triangle_of(outer)].mate[index_of(outer)] = inner;
  }

  std::vector<Point> point_;           // by vertex slot
  std::vector<std::uint32_t> region_;  // by vertex slot: index in maps_
  std::vector<Triangle> triangle_;
  std::vector<LinearMap2> maps_;
  std::vector<bool> done_;  // regions whose metric is that of the triangulation
  std::uint32_t last_ = 0;
  std::vector<Side> pending_;
};

}  // namespace

template <class Triangulation>
std::vector<std::array<VertexId, 3>> metric_triangles(const Triangulation& triangulation,
                                                      const MetricField2& field,
                                                      const std::optional<Box3>& window) {
  Flips flips(triangulation, field, window);
  flips.run();
  return flips.result();
}

template std::vector<std::array<VertexId, 3>> metric_triangles(const Delaunay2<std::int32_t>&,
                                                               const MetricField2&,
                                                               const std::optional<Box3>&);
template std::vector<std::array<VertexId, 3>> metric_triangles(const Delaunay2<double>&,
                                                               const MetricField2&,
                                                               const std::optional<Box3>&);
template std::vector<std::array<VertexId, 3>> metric_triangles(
    const Delaunay2<double, EllipticalMetric2>&, const MetricField2&, const std::optional<Box3>&);

}  // namespace terrace::tri
