// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <string>

#include <terrace/base/stop_check.hpp>

#include "delaunay2/elliptical_kernel.hpp"
#include "flip_mesh.hpp"
#include "terrace/tri/metric.hpp"

namespace terrace::tri {
namespace {

using namespace planar;

constexpr std::uint32_t kNoRegion = 0xFFFFFFFFu;

const LinearMap2& map_of(const Euclidean&) { return kIdentityMap<2>; }
const LinearMap2& map_of(const EllipticalMetric2& metric) { return metric.map(); }

/// A copy of a triangulation in which edges are flipped until each region is Delaunay in its
/// metric. Instead of ghost triangles, kNoMate marks the border.
class MetricFlipper {
 public:
  template <class Triangulation>
  MetricFlipper(const Triangulation& triangulation, const MetricField2& field,
                const TriangleFilter& filter, const base::StopCheck& check_stop)
      : ticks_(check_stop),
        points_(triangulation.vertex_slots()),
        region_of_vertex_(triangulation.vertex_slots(), kNoRegion) {
    if (!filter) mesh_.triangle.reserve(triangulation.triangle_count());
    // The dense number of each participating triangle.
    std::vector<std::uint32_t> number(triangulation.triangle_slots(), kNone);
    for (const TriangleId id : triangulation.all_triangles()) {
      ticks_(64);
      const auto corners = triangulation.vertices(id);
      for (const VertexId v : corners) {
        const auto p = triangulation.point(v);
        points_[slot(v)] = {static_cast<double>(p[0]), static_cast<double>(p[1])};
      }
      if (filter && !filter(id)) continue;
      number[slot(id)] = static_cast<std::uint32_t>(mesh_.triangle.size());
      mesh_.triangle.push_back({{slot(corners[0]), slot(corners[1]), slot(corners[2])}, {}});
    }
    for (const TriangleId id : triangulation.all_triangles()) {
      ticks_(64);
      if (number[slot(id)] == kNone) continue;
      Triangle& t = mesh_.triangle[number[slot(id)]];
      const auto neighbours = triangulation.neighbours(id);
      for (std::uint32_t i = 0; i < 3; ++i) {
        const std::uint32_t other =
            neighbours[i] == kNoTriangle ? kNone : number[slot(neighbours[i])];
        t.mate[i] = kNoMate;
        if (other == kNone) continue;
        // Seen from the other triangle the edge is reversed, so its first corner is this one's
        // second.
        const auto& corner = mesh_.triangle[other].corner;
        const auto at = std::find(corner.begin(), corner.end(), t.corner[previous_index(i)]);
        t.mate[i] =
            make_side(other, previous_index(static_cast<std::uint32_t>(at - corner.begin())));
      }
    }
    find_regions(field, map_of(triangulation.metric()));
  }

  void run() {
    // Lists the triangles of each region.
    std::vector<std::vector<std::uint32_t>> members(maps_.size());
    for (std::uint32_t t = 0; t < mesh_.triangle.size(); ++t) {
      const std::uint32_t region = region_of(mesh_.triangle[t]);
      if (region != kNoRegion && !is_done_[region]) members[region].push_back(t);
    }
    for (std::uint32_t region = 0; region < maps_.size(); ++region) {
      if (members[region].empty()) continue;
      const QuadraticForm form(maps_[region]);
      const EllipticalKernel::Scope scope(form);
      for (const std::uint32_t t : members[region]) {
        ticks_(256);
        for (std::uint32_t i = 0; i < 3; ++i) pending_.push_back(make_side(t, i));
        // Two of the neighbour's corners belong to this triangle, so only the third is checked.
        mesh_.settle<EllipticalKernel>(
            pending_, points_,
            [&](Side, Side mate) {
              return region_of_vertex_[mesh_.triangle[triangle_of(mate)].corner[index_of(mate)]] ==
                     region;
            },
            [this](std::uint32_t, std::uint32_t) { ticks_(256); });
      }
    }
  }

  [[nodiscard]] std::vector<std::array<VertexId, 3>> result() const {
    std::vector<std::array<VertexId, 3>> all;
    all.reserve(mesh_.triangle.size());
    for (const Triangle& t : mesh_.triangle) {
      std::uint32_t i = 0;
      for (std::uint32_t k = 1; k < 3; ++k)
        if (lexicographically_less(points_[t.corner[k]], points_[t.corner[i]])) i = k;
      all.push_back({VertexId{t.corner[i]}, VertexId{t.corner[next_index(i)]},
                     VertexId{t.corner[previous_index(i)]}});
    }
    return all;
  }

 private:
  using Point = EllipticalKernel::Point;

  void find_regions(const MetricField2& field, const LinearMap2& own_map) {
    std::map<LinearMap2, std::uint32_t> map_index;
    for (const Triangle& t : mesh_.triangle) {
      ticks_(256);
      for (const std::uint32_t v : t.corner) {
        if (region_of_vertex_[v] != kNoRegion) continue;
        const LinearMap2 map = field(points_[v]);
        // Successive vertices are mostly in the same region.
        if (maps_.empty() || map != maps_[last_]) {
          // Checked before it becomes a key, because NaN has no order.
          check_metric(map, "the field of metrics: the map at " + std::to_string(points_[v][0]) +
                                ", " + std::to_string(points_[v][1]));
          const auto [at, is_new] =
              map_index.try_emplace(map, static_cast<std::uint32_t>(maps_.size()));
          if (is_new) {
            maps_.push_back(map);
            is_done_.push_back(map == own_map);
          }
          last_ = at->second;
        }
        region_of_vertex_[v] = last_;
      }
    }
  }

  [[nodiscard]] std::uint32_t region_of(const Triangle& t) const {
    const std::uint32_t region = region_of_vertex_[t.corner[0]];
    return region_of_vertex_[t.corner[1]] == region && region_of_vertex_[t.corner[2]] == region
               ? region
               : kNoRegion;
  }

  base::StopTicks ticks_;
  std::vector<Point> points_;                    // by vertex slot
  std::vector<std::uint32_t> region_of_vertex_;  // by vertex slot: index in maps_
  FlipMesh mesh_;
  std::vector<LinearMap2> maps_;
  std::vector<bool> is_done_;  // true for regions with the metric of the triangulation
  std::uint32_t last_ = 0;
  std::vector<Side> pending_;
};

}  // namespace

template <class Triangulation>
std::vector<std::array<VertexId, 3>> metric_triangles(const Triangulation& triangulation,
                                                      const MetricField2& field,
                                                      const TriangleFilter& filter,
                                                      const base::StopCheck& check_stop) {
  MetricFlipper flipper(triangulation, field, filter, check_stop);
  flipper.run();
  return flipper.result();
}

template <class Triangulation>
std::vector<std::array<VertexId, 3>> metric_triangles(const Triangulation& triangulation,
                                                      const MetricField2& field,
                                                      const Box3& window) {
  return metric_triangles(triangulation, field, [&](TriangleId id) {
    const auto corners = triangulation.vertices(id);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const auto at = [&](std::size_t i) {
        return static_cast<double>(triangulation.point(corners[i])[axis]);
      };
      const auto [least, most] = std::minmax({at(0), at(1), at(2)});
      if (!(least <= window.max[axis] && window.min[axis] <= most)) return false;
    }
    return true;
  });
}

template std::vector<std::array<VertexId, 3>> metric_triangles(const Delaunay2<std::int32_t>&,
                                                               const MetricField2&,
                                                               const TriangleFilter&,
                                                               const base::StopCheck&);
template std::vector<std::array<VertexId, 3>> metric_triangles(const Delaunay2<std::int32_t>&,
                                                               const MetricField2&, const Box3&);
template std::vector<std::array<VertexId, 3>> metric_triangles(const Delaunay2<double>&,
                                                               const MetricField2&,
                                                               const TriangleFilter&,
                                                               const base::StopCheck&);
template std::vector<std::array<VertexId, 3>> metric_triangles(const Delaunay2<double>&,
                                                               const MetricField2&, const Box3&);
template std::vector<std::array<VertexId, 3>> metric_triangles(
    const Delaunay2<double, EllipticalMetric2>&, const MetricField2&, const TriangleFilter&,
    const base::StopCheck&);
template std::vector<std::array<VertexId, 3>> metric_triangles(
    const Delaunay2<double, EllipticalMetric2>&, const MetricField2&, const Box3&);

}  // namespace terrace::tri
