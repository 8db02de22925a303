// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <numeric>
#include <string>

#include "flips3.hpp"
#include "terrace/tri/elliptical.hpp"

namespace terrace::tri {
namespace {

using spatial::EllipticalKernel;
using spatial::EllipticalMetric;

template <class Coord>
LinearMap3 map_of(const Delaunay3<Coord>&) {
  return kIdentityMap3;
}
LinearMap3 map_of(const EllipticalDelaunay3& triangulation) { return triangulation.map(); }

/// Regions are numbered as their vertices come; the map of each.
template <class Triangulation>
std::vector<LinearMap3> find_regions(const Triangulation& triangulation, const MetricField3& field,
                                     Flips3& flips) {
  std::vector<LinearMap3> maps;
  std::map<LinearMap3, std::uint32_t> known;
  std::uint32_t last = 0;
  for (const VertexId v : triangulation.all_vertices()) {
    const auto p = triangulation.point(v);
    auto& place = flips.vertex[slot(v)].point;
    for (std::size_t k = 0; k < 3; ++k) place[k] = static_cast<double>(p[k]);
    const LinearMap3 map = field(place);
    // Vertices that follow each other mostly share their region.
    if (maps.empty() || map != maps[last]) {
      // Before it is a key: NaN has no order.
      check_metric(map, "the field of metrics: the map at " + std::to_string(place[0]) + ", " +
                            std::to_string(place[1]) + ", " + std::to_string(place[2]));
      const auto [at, fresh] = known.try_emplace(map, static_cast<std::uint32_t>(maps.size()));
      if (fresh) maps.push_back(map);
      last = at->second;
    }
    flips.region[slot(v)] = last;
  }
  return maps;
}

template <class Triangulation>
void rank_vertices(const Triangulation& triangulation, Flips3& flips) {
  std::vector<std::uint32_t> order;
  for (const VertexId v : triangulation.all_vertices()) order.push_back(slot(v));
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return spatial::lexicographically_less(flips.vertex[a].point, flips.vertex[b].point);
  });
  for (std::uint32_t i = 0; i < order.size(); ++i) flips.rank[order[i]] = i;
}

/// Dense numbers.
template <class Triangulation>
void copy_tetrahedra(const Triangulation& triangulation, Flips3& flips) {
  std::vector<std::uint32_t> number(triangulation.tetrahedron_slots());
  std::uint32_t count = 0;
  for (const TetrahedronId t : triangulation.all_tetrahedra()) number[slot(t)] = count++;
  flips.tetrahedron.resize(count);
  for (const TetrahedronId id : triangulation.all_tetrahedra()) {
    const auto corners = triangulation.vertices(id);
    for (std::size_t k = 0; k < 4; ++k)
      flips.tetrahedron[number[slot(id)]].corner[k] = slot(corners[k]);
  }
  for (const TetrahedronId id : triangulation.all_tetrahedra()) {
    const auto beyond = triangulation.neighbours(id);
    auto& t = flips.tetrahedron[number[slot(id)]];
    for (std::uint32_t i = 0; i < 4; ++i) {
      t.mate[i] = Flips3::kHullSide;
      if (beyond[i] == kNoTetrahedron) continue;
      const std::uint32_t other = number[slot(beyond[i])];
      // From there it is opposite to the corner that is not one of this one's.
      const auto& corner = flips.tetrahedron[other].corner;
      std::uint32_t k = 0;
      while (std::find(t.corner.begin(), t.corner.end(), corner[k]) != t.corner.end()) ++k;
      t.mate[i] = spatial::make_side(other, k);
    }
  }
}

/// All in one region: of the points alone, without flips.
template <class Triangulation>
void build_anew(const Triangulation& triangulation, const LinearMap3& map,
                MetricTetrahedra& result) {
  std::vector<EllipticalDelaunay3::Point> points;
  std::vector<VertexId> vertices;
  for (const VertexId v : triangulation.all_vertices()) {
    const auto p = triangulation.point(v);
    points.push_back(
        {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
    vertices.push_back(v);
  }
  EllipticalDelaunay3 elliptical(map);
  const std::vector<VertexId> built = elliptical.build(points);
  std::vector<VertexId> given(elliptical.vertex_slots(), kNoVertex);
  for (std::size_t i = 0; i < built.size(); ++i) given[slot(built[i])] = vertices[i];
  result.tetrahedra.reserve(elliptical.tetrahedron_count());
  for (const TetrahedronId t : elliptical.all_tetrahedra()) {
    auto corners = elliptical.vertices(t);
    for (VertexId& v : corners) v = given[slot(v)];
    result.tetrahedra.push_back(corners);
  }
}

}  // namespace

template <class Triangulation>
MetricTetrahedra metric_tetrahedra(const Triangulation& triangulation, const MetricField3& field) {
  const LinearMap3 given = map_of(triangulation);
  MetricTetrahedra result;
  Flips3 flips;
  flips.vertex.resize(triangulation.vertex_slots());
  flips.region.resize(triangulation.vertex_slots(), Flips3::kNoRegion);
  flips.rank.resize(triangulation.vertex_slots());
  const std::vector<LinearMap3> maps = find_regions(triangulation, field, flips);
  if (triangulation.tetrahedron_count() == 0) return result;
  if (maps.size() == 1 && maps[0] != given) {
    build_anew(triangulation, maps[0], result);
    return result;
  }
  rank_vertices(triangulation, flips);
  copy_tetrahedra(triangulation, flips);
  std::vector<std::vector<std::uint32_t>> members(maps.size());
  for (std::uint32_t t = 0; t < flips.tetrahedron.size(); ++t) {
    const std::uint32_t region = flips.region_of(t);
    if (region != Flips3::kNoRegion && maps[region] != given) members[region].push_back(t);
  }
  for (std::uint32_t region = 0; region < maps.size(); ++region) {
    if (members[region].empty()) continue;
    const EllipticalMetric metric(maps[region]);
    const EllipticalKernel::Scope scope(metric);
    result.stuck += flips.settle(region, members[region]);
  }
  result.flips = flips.flip_count();
  result.tetrahedra.reserve(flips.tetrahedron.size());
  for (std::uint32_t t = 0; t < flips.tetrahedron.size(); ++t) {
    if (!flips.alive(t)) continue;
    const auto& [a, b, c, d] = flips.tetrahedron[t].corner;
    result.tetrahedra.push_back({VertexId{a}, VertexId{b}, VertexId{c}, VertexId{d}});
  }
  return result;
}

template MetricTetrahedra metric_tetrahedra(const Delaunay3<std::int32_t>&, const MetricField3&);
template MetricTetrahedra metric_tetrahedra(const Delaunay3<double>&, const MetricField3&);
template MetricTetrahedra metric_tetrahedra(const EllipticalDelaunay3&, const MetricField3&);

}  // namespace terrace::tri
