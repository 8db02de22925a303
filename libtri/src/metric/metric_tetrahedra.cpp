// SPDX-License-Identifier: Apache-2.0
// Flips tetrahedra of one region. Consider a facet that is not Delaunay, with apices d and e. If
// the line from d to e passes through the facet, two tetrahedra become three. If it passes outside
// an edge, the three tetrahedra at that edge become two, provided that there are only three. If it
// meets the edge, the four (or on the hull two) at that edge are replaced by as many. Otherwise the
// facet is stuck until its neighbourhood changes.
//
// Facets wait in the order of their corners, not of their slots, so the result is canonical.
#include <algorithm>
#include <array>
#include <cassert>
#include <map>
#include <queue>
#include <span>
#include <string>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "delaunay3/elliptical_kernel.hpp"
#include "delaunay3/predicates.hpp"
#include "terrace/tri/metric.hpp"

namespace terrace::tri {
namespace {

using namespace spatial;

/// A copy of tetrahedra that can be flipped. It has no ghosts. kHullSide represents the outside.
class Flips {
 public:
  explicit Flips(const base::StopCheck& check_stop) : ticks_(check_stop) {}

  using Vertex = EllipticalKernel::Vertex;
  static constexpr Side kHullSide = 0xFFFFFFFFu;
  static constexpr std::uint32_t kNoRegion = 0xFFFFFFFFu;

  // By vertex slot: the point, the number of its region, its rank in lexicographic order.
  std::vector<Vertex> vertex;
  std::vector<std::uint32_t> region;
  std::vector<std::uint32_t> rank;
  std::vector<Tetrahedron> tetrahedron;

  [[nodiscard]] bool alive(std::uint32_t t) const {
    return tetrahedron[t].corner[0] != kFreeCorner;
  }
  [[nodiscard]] std::uint32_t region_of(std::uint32_t t) const;

  /// Flips the tetrahedra of a region, in the metric of the scope, until nothing changes.
  /// `members`: the tetrahedra of the region at the start. Returns the number of stuck facets.
  std::size_t settle(std::uint32_t number, const std::vector<std::uint32_t>& members);
  [[nodiscard]] std::size_t flip_count() const { return flips_; }

 private:
  using Corners = std::array<std::uint32_t, 4>;
  using Key = std::array<std::uint32_t, 3>;  ///< ranks of a facet's corners, sorted
  struct Pending {
    Key key;
    Side side;
    bool operator<(const Pending& other) const { return other.key < key; }  ///< smallest first
  };

  [[nodiscard]] Key key_of(Side side) const;
  [[nodiscard]] bool is_delaunay(std::uint32_t t, std::uint32_t i) const;
  bool try_flip(std::uint32_t t, std::uint32_t i);
  bool flip_at_edge(std::uint32_t t, std::uint32_t i, std::uint32_t edge, bool coplanar);
  [[nodiscard]] std::uint32_t apex_beyond(std::uint32_t t, std::uint32_t corner) const;
  void replace(std::span<const std::uint32_t> old, std::span<const Corners> added);
  std::uint32_t new_slot();

  std::uint32_t number_ = 0;
  std::size_t flips_ = 0;
  std::uint32_t free_ = kNone;
  std::priority_queue<Pending> pending_;
  base::StopTicks ticks_;
};

std::uint32_t Flips::region_of(std::uint32_t t) const {
  const Corners& corner = tetrahedron[t].corner;
  const std::uint32_t first = region[corner[0]];
  for (const std::uint32_t v : corner)
    if (region[v] != first) return kNoRegion;
  return first;
}

Flips::Key Flips::key_of(Side side) const {
  const auto f = facet_of(tetrahedron[tetrahedron_of(side)], index_of(side));
  Key key{rank[f[0]], rank[f[1]], rank[f[2]]};
  std::sort(key.begin(), key.end());
  return key;
}

/// Called for a tetrahedron of the region. Also true at the region's border, where no flip is
/// possible.
bool Flips::is_delaunay(std::uint32_t t, std::uint32_t i) const {
  const Side mate = tetrahedron[t].mate[i];
  if (mate == kHullSide) return true;
  const std::uint32_t e = tetrahedron[tetrahedron_of(mate)].corner[index_of(mate)];
  if (region[e] != number_) return true;
  const Corners& c = tetrahedron[t].corner;
  return !inside_sphere<EllipticalKernel>(vertex[c[0]], vertex[c[1]], vertex[c[2]], vertex[c[3]],
                                          vertex[e].point, {});
}

std::size_t Flips::settle(std::uint32_t number, const std::vector<std::uint32_t>& members) {
  number_ = number;
  for (const std::uint32_t t : members) {
    ticks_(512);
    for (std::uint32_t i = 0; i < 4; ++i) {
      // Takes each facet from one side.
      const Side mate = tetrahedron[t].mate[i];
      if (mate != kHullSide && mate > make_side(t, i) && !is_delaunay(t, i))
        pending_.push({key_of(make_side(t, i)), make_side(t, i)});
    }
  }
  std::vector<Pending> stuck;
  while (true) {
    stuck.clear();
    const std::size_t flips_before = flips_;
    while (!pending_.empty()) {
      const Pending next = pending_.top();
      pending_.pop();
      ticks_(1024);
      const std::uint32_t t = tetrahedron_of(next.side);
      if (!alive(t) || key_of(next.side) != next.key || is_delaunay(t, index_of(next.side)))
        continue;
      if (!try_flip(t, index_of(next.side))) stuck.push_back(next);
    }
    // A flip elsewhere may have freed a stuck facet.
    if (flips_ == flips_before) break;
    for (const Pending& one : stuck) pending_.push(one);
  }
  // There may be duplicates.
  std::sort(stuck.begin(), stuck.end(),
            [](const Pending& a, const Pending& b) { return a.key < b.key; });
  const auto end = std::unique(stuck.begin(), stuck.end(),
                               [](const Pending& a, const Pending& b) { return a.key == b.key; });
  return static_cast<std::size_t>(end - stuck.begin());
}

bool Flips::try_flip(std::uint32_t t, std::uint32_t i) {
  const Side mate = tetrahedron[t].mate[i];
  const std::uint32_t o = tetrahedron_of(mate);
  const std::uint32_t d = tetrahedron[t].corner[i];
  const std::uint32_t e = tetrahedron[o].corner[index_of(mate)];
  // Decides on which side of the facets at d e is. Each of the facet's edges is opposite to one of
  // its corners.
  std::uint32_t passed = 4;
  bool coplanar = false;
  for (std::uint32_t k = 0; k < 4; ++k) {
    if (k == i) continue;
    const int side =
        orientation_with<EllipticalKernel>(vertex.data(), tetrahedron[t], k, vertex[e].point);
    if (side > 0) continue;
    if (passed != 4) return false;
    passed = k;
    coplanar = side == 0;
  }
  if (passed != 4) return flip_at_edge(t, i, passed, coplanar);
  const auto [a, b, c] = facet_of(tetrahedron[t], i);
  replace(std::array{t, o},
          std::array{Corners{d, e, a, b}, Corners{d, e, b, c}, Corners{d, e, c, a}});
  return true;
}

/// The corner beyond the facet opposite to a given corner, or kNone beyond the hull.
std::uint32_t Flips::apex_beyond(std::uint32_t t, std::uint32_t corner) const {
  std::uint32_t k = 0;
  while (tetrahedron[t].corner[k] != corner) ++k;
  const Side side = tetrahedron[t].mate[k];
  return side == kHullSide ? kNone : tetrahedron[tetrahedron_of(side)].corner[index_of(side)];
}

/// Flips where the line passes outside the edge opposite to corner number `edge` of the facet, or
/// meets it (`coplanar`). Returns false if no flip is possible.
bool Flips::flip_at_edge(std::uint32_t t, std::uint32_t i, std::uint32_t edge, bool coplanar) {
  const Side mate = tetrahedron[t].mate[i];
  const std::uint32_t o = tetrahedron_of(mate);
  const std::uint32_t d = tetrahedron[t].corner[i];
  const std::uint32_t e = tetrahedron[o].corner[index_of(mate)];
  const std::uint32_t c = tetrahedron[t].corner[edge];
  std::array<std::uint32_t, 2> ends{};
  for (std::uint32_t k = 0, n = 0; k < 4; ++k)
    if (k != i && k != edge) ends[n++] = tetrahedron[t].corner[k];
  const auto [a, b] = ends;
  const std::uint32_t f = apex_beyond(t, c);
  const auto neighbour_of = [&](std::uint32_t from) {
    std::uint32_t k = 0;
    while (tetrahedron[from].corner[k] != c) ++k;
    return tetrahedron_of(tetrahedron[from].mate[k]);
  };
  if (!coplanar) {
    if (f != e) return false;
    replace(std::array{t, o, neighbour_of(t)},
            std::array{Corners{c, d, e, a}, Corners{c, d, e, b}});
    return true;
  }
  if (apex_beyond(o, c) != f) return false;
  if (f == kNone) {
    replace(std::array{t, o}, std::array{Corners{c, d, e, a}, Corners{c, d, e, b}});
    return true;
  }
  if (region[f] != number_) return false;
  replace(std::array{t, o, neighbour_of(t), neighbour_of(o)},
          std::array{Corners{c, d, e, a}, Corners{c, d, e, b}, Corners{f, d, e, a},
                     Corners{f, d, e, b}});
  return true;
}

std::uint32_t Flips::new_slot() {
  if (free_ == kNone) {
    tetrahedron.push_back({});
    return static_cast<std::uint32_t>(tetrahedron.size() - 1);
  }
  const std::uint32_t t = free_;
  free_ = tetrahedron[t].corner[1];
  return t;
}

/// Replaces tetrahedra by others, with corners in any order, that fill the same space.
void Flips::replace(std::span<const std::uint32_t> old, std::span<const Corners> added) {
  struct Facet {
    Key key;
    Side side;
  };
  // Facets that wait for a second tetrahedron: first those on the boundary, then those of new ones.
  std::array<Facet, 16> open;
  std::size_t count = 0;
  for (const std::uint32_t t : old) {
    for (std::uint32_t i = 0; i < 4; ++i) {
      const Side mate = tetrahedron[t].mate[i];
      if (mate == kHullSide || std::find(old.begin(), old.end(), tetrahedron_of(mate)) != old.end())
        continue;
      open[count++] = {key_of(mate), mate};
    }
  }
  for (const std::uint32_t t : old) {
    tetrahedron[t].corner = {kFreeCorner, free_, 0, 0};
    free_ = t;
  }
  for (Corners corner : added) {
    const auto at = [&](std::size_t k) -> const auto& { return vertex[corner[k]].point; };
    const int turn = EllipticalKernel::orientation(at(0), at(1), at(2), at(3));
    assert(turn != 0);
    if (turn < 0) std::swap(corner[0], corner[1]);
    const std::uint32_t t = new_slot();
    tetrahedron[t].corner = corner;
    for (std::uint32_t i = 0; i < 4; ++i) {
      const Side side = make_side(t, i);
      const Key key = key_of(side);
      std::size_t k = 0;
      while (k < count && open[k].key != key) ++k;
      if (k == count) {
        // Its mate comes later, or it is on the hull.
        tetrahedron[t].mate[i] = kHullSide;
        open[count++] = {key, side};
        continue;
      }
      const Side mate = open[k].side;
      tetrahedron[t].mate[i] = mate;
      tetrahedron[tetrahedron_of(mate)].mate[index_of(mate)] = side;
      open[k] = open[--count];
      pending_.push({key, side});
    }
  }
  ++flips_;
}

const LinearMap3& map_of(const Euclidean&) { return kIdentityMap<3>; }
const LinearMap3& map_of(const EllipticalMetric3& metric) { return metric.map(); }

/// Numbers the regions in the order of their vertices and keeps the map of each.
template <class Triangulation>
std::vector<LinearMap3> find_regions(const Triangulation& triangulation, const MetricField3& field,
                                     Flips& flips) {
  std::vector<LinearMap3> maps;
  std::map<LinearMap3, std::uint32_t> map_index;
  std::uint32_t last = 0;
  for (const VertexId v : triangulation.all_vertices()) {
    const auto p = triangulation.point(v);
    auto& place = flips.vertex[slot(v)].point;
    for (std::size_t k = 0; k < 3; ++k) place[k] = static_cast<double>(p[k]);
    const LinearMap3 map = field(place);
    // Successive vertices are mostly in the same region.
    if (maps.empty() || map != maps[last]) {
      // Checked before it becomes a key, because NaN has no order.
      check_metric(map, "the field of metrics: the map at " + std::to_string(place[0]) + ", " +
                            std::to_string(place[1]) + ", " + std::to_string(place[2]));
      const auto [at, added] = map_index.try_emplace(map, static_cast<std::uint32_t>(maps.size()));
      if (added) maps.push_back(map);
      last = at->second;
    }
    flips.region[slot(v)] = last;
  }
  return maps;
}

template <class Triangulation>
void rank_vertices(const Triangulation& triangulation, Flips& flips) {
  std::vector<std::uint32_t> order;
  for (const VertexId v : triangulation.all_vertices()) order.push_back(slot(v));
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return lexicographically_less(flips.vertex[a].point, flips.vertex[b].point);
  });
  for (std::uint32_t i = 0; i < order.size(); ++i) flips.rank[order[i]] = i;
}

/// Gives the tetrahedra dense numbers.
template <class Triangulation>
void copy_tetrahedra(const Triangulation& triangulation, Flips& flips) {
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
    const auto neighbour_of = triangulation.neighbours(id);
    auto& t = flips.tetrahedron[number[slot(id)]];
    for (std::uint32_t i = 0; i < 4; ++i) {
      t.mate[i] = Flips::kHullSide;
      if (neighbour_of[i] == kNoTetrahedron) continue;
      const std::uint32_t other = number[slot(neighbour_of[i])];
      // From there, the facet is opposite to the corner that is not a corner of this tetrahedron.
      const auto& corner = flips.tetrahedron[other].corner;
      std::uint32_t k = 0;
      while (std::find(t.corner.begin(), t.corner.end(), corner[k]) != t.corner.end()) ++k;
      t.mate[i] = make_side(other, k);
    }
  }
}

/// Triangulates points that are all in one region from scratch, without flips.
template <class Triangulation>
void build_anew(const Triangulation& triangulation, const LinearMap3& map,
                const base::StopCheck& check_stop, MetricTetrahedra& result) {
  std::vector<Delaunay3<double>::Point> points;
  std::vector<VertexId> vertices;
  for (const VertexId v : triangulation.all_vertices()) {
    const auto p = triangulation.point(v);
    points.push_back(
        {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
    vertices.push_back(v);
  }
  Delaunay3<double, EllipticalMetric3> elliptical(map);
  elliptical.set_check_stop(check_stop);
  const std::vector<VertexId> built = elliptical.build(points);
  std::vector<VertexId> vertex_of(elliptical.vertex_slots(), kNoVertex);
  for (std::size_t i = 0; i < built.size(); ++i) vertex_of[slot(built[i])] = vertices[i];
  result.tetrahedra.reserve(elliptical.tetrahedron_count());
  for (const TetrahedronId t : elliptical.all_tetrahedra()) {
    auto corners = elliptical.vertices(t);
    for (VertexId& v : corners) v = vertex_of[slot(v)];
    result.tetrahedra.push_back(corners);
  }
}

}  // namespace

template <class Triangulation>
MetricTetrahedra metric_tetrahedra(const Triangulation& triangulation, const MetricField3& field,
                                   const base::StopCheck& check_stop) {
  const LinearMap3 own_map = map_of(triangulation.metric());
  MetricTetrahedra result;
  Flips flips(check_stop);
  flips.vertex.resize(triangulation.vertex_slots());
  flips.region.resize(triangulation.vertex_slots(), Flips::kNoRegion);
  flips.rank.resize(triangulation.vertex_slots());
  const std::vector<LinearMap3> maps = find_regions(triangulation, field, flips);
  if (triangulation.tetrahedron_count() == 0) return result;
  if (maps.size() == 1 && maps[0] != own_map) {
    build_anew(triangulation, maps[0], check_stop, result);
    return result;
  }
  rank_vertices(triangulation, flips);
  copy_tetrahedra(triangulation, flips);
  std::vector<std::vector<std::uint32_t>> members(maps.size());
  for (std::uint32_t t = 0; t < flips.tetrahedron.size(); ++t) {
    const std::uint32_t region = flips.region_of(t);
    if (region != Flips::kNoRegion && maps[region] != own_map) members[region].push_back(t);
  }
  for (std::uint32_t region = 0; region < maps.size(); ++region) {
    if (members[region].empty()) continue;
    const QuadraticForm form(maps[region]);
    const EllipticalKernel::Scope scope(form);
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

template MetricTetrahedra metric_tetrahedra(const Delaunay3<std::int32_t>&, const MetricField3&,
                                            const base::StopCheck&);
template MetricTetrahedra metric_tetrahedra(const Delaunay3<double>&, const MetricField3&,
                                            const base::StopCheck&);
template MetricTetrahedra metric_tetrahedra(const Delaunay3<double, EllipticalMetric3>&,
                                            const MetricField3&, const base::StopCheck&);

}  // namespace terrace::tri
