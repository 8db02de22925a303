// SPDX-License-Identifier: Apache-2.0
// Flips of tetrahedra of one region. A facet that is not Delaunay, with apices d and e: where the
// line from d to e goes through the facet, two tetrahedra become three; where it passes an edge,
// the three at that edge become two if there are only three; where it meets the edge, the four (or
// on the hull two) at that edge become as many. Otherwise the facet is stuck until its
// neighbourhood changes.
//
// Facets wait in the order of their corners, whatever their slots: so the result is canonical.
#include "flips3.hpp"

namespace terrace::tri {

using namespace spatial;

std::uint32_t Flips3::region_of(std::uint32_t t) const {
  const Corners& corner = tetrahedron[t].corner;
  const std::uint32_t first = region[corner[0]];
  for (const std::uint32_t v : corner)
    if (region[v] != first) return kNoRegion;
  return first;
}

Flips3::Key Flips3::key_of(Side side) const {
  const auto f = facet_of(tetrahedron[tetrahedron_of(side)], index_of(side));
  Key key{rank[f[0]], rank[f[1]], rank[f[2]]};
  std::sort(key.begin(), key.end());
  return key;
}

/// Asked of a tetrahedron of the region; also true at its border, where nothing can be done.
bool Flips3::is_delaunay(std::uint32_t t, std::uint32_t i) const {
  const Side mate = tetrahedron[t].mate[i];
  if (mate == kHullSide) return true;
  const std::uint32_t e = tetrahedron[tetrahedron_of(mate)].corner[index_of(mate)];
  if (region[e] != number_) return true;
  const Corners& c = tetrahedron[t].corner;
  return !inside_sphere<EllipticalKernel>(vertex[c[0]], vertex[c[1]], vertex[c[2]], vertex[c[3]],
                                          vertex[e].point, {});
}

std::size_t Flips3::settle(std::uint32_t number, const std::vector<std::uint32_t>& own) {
  number_ = number;
  for (const std::uint32_t t : own) {
    for (std::uint32_t i = 0; i < 4; ++i) {
      // Each facet from one side.
      const Side mate = tetrahedron[t].mate[i];
      if (mate != kHullSide && mate > make_side(t, i) && !is_delaunay(t, i))
        pending_.push({key_of(make_side(t, i)), make_side(t, i)});
    }
  }
  std::vector<Pending> stuck;
  while (true) {
    stuck.clear();
    const std::size_t before = flips_;
    while (!pending_.empty()) {
      const Pending next = pending_.top();
      pending_.pop();
      const std::uint32_t t = tetrahedron_of(next.side);
      if (!alive(t) || key_of(next.side) != next.key || is_delaunay(t, index_of(next.side)))
        continue;
      if (!try_flip(t, index_of(next.side))) stuck.push_back(next);
    }
    // A flip elsewhere may have set one free.
    if (flips_ == before) break;
    for (const Pending& one : stuck) pending_.push(one);
  }
  // Some may be there twice.
  std::sort(stuck.begin(), stuck.end(),
            [](const Pending& a, const Pending& b) { return a.key < b.key; });
  const auto end = std::unique(stuck.begin(), stuck.end(),
                               [](const Pending& a, const Pending& b) { return a.key == b.key; });
  return static_cast<std::size_t>(end - stuck.begin());
}

bool Flips3::try_flip(std::uint32_t t, std::uint32_t i) {
  const Side mate = tetrahedron[t].mate[i];
  const std::uint32_t o = tetrahedron_of(mate);
  const std::uint32_t d = tetrahedron[t].corner[i];
  const std::uint32_t e = tetrahedron[o].corner[index_of(mate)];
  // On which side of the facets at d is e? Opposite to one of the facet's corners is its edge.
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

/// The corner beyond the facet opposite to a corner, or kNone beyond the hull.
std::uint32_t Flips3::apex_beyond(std::uint32_t t, std::uint32_t corner) const {
  std::uint32_t k = 0;
  while (tetrahedron[t].corner[k] != corner) ++k;
  const Side side = tetrahedron[t].mate[k];
  return side == kHullSide ? kNone : tetrahedron[tetrahedron_of(side)].corner[index_of(side)];
}

/// The line passes the edge opposite to corner number `edge` of the facet.
bool Flips3::flip_at_edge(std::uint32_t t, std::uint32_t i, std::uint32_t edge, bool coplanar) {
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
  const auto beyond = [&](std::uint32_t from) {
    std::uint32_t k = 0;
    while (tetrahedron[from].corner[k] != c) ++k;
    return tetrahedron_of(tetrahedron[from].mate[k]);
  };
  if (!coplanar) {
    if (f != e) return false;
    replace(std::array{t, o, beyond(t)}, std::array{Corners{c, d, e, a}, Corners{c, d, e, b}});
    return true;
  }
  if (apex_beyond(o, c) != f) return false;
  if (f == kNone) {
    replace(std::array{t, o}, std::array{Corners{c, d, e, a}, Corners{c, d, e, b}});
    return true;
  }
  if (region[f] != number_) return false;
  replace(std::array{t, o, beyond(t), beyond(o)},
          std::array{Corners{c, d, e, a}, Corners{c, d, e, b}, Corners{f, d, e, a},
                     Corners{f, d, e, b}});
  return true;
}

std::uint32_t Flips3::new_slot() {
  if (free_ == kNone) {
    tetrahedron.push_back({});
    return static_cast<std::uint32_t>(tetrahedron.size() - 1);
  }
  const std::uint32_t t = free_;
  free_ = tetrahedron[t].corner[1];
  return t;
}

/// Takes tetrahedra out and puts others, corners in any order, into the same space.
void Flips3::replace(std::span<const std::uint32_t> old, std::span<const Corners> fresh) {
  struct Facet {
    Key key;
    Side side;
  };
  // Facets that wait for a tetrahedron: those round it, then those of new ones.
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
  for (Corners corner : fresh) {
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

}  // namespace terrace::tri
