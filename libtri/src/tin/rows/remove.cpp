// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "ground.hpp"
#include "surface.hpp"
#include "tin/lattice.hpp"

namespace terrace::tri::tin::rows {

bool RowSurface::wide(const Vertex& a, const Vertex& b, const Vertex& c) const {
  const auto square = [](const Vertex& p, const Vertex& q) {
    const std::int64_t x = q.x - p.x, y = q.y - p.y;
    return x * x + y * y;
  };
  const std::int64_t ab = square(a, b), bc = square(b, c), ca = square(c, a);
  // The scalar product at the smallest angle, which is opposite to the shortest side.
  const std::int64_t twice = ab + bc + ca - 2 * std::min({ab, bc, ca});
  return 2.0 * static_cast<double>(turn(a, b, c)) >= tangent_ * static_cast<double>(twice);
}

bool RowSurface::fits(const Vertex& a, const Vertex& b, const Vertex& c) const {
  return scan_.within(samples_, corner(a), corner(b), corner(c), options_.max_error);
}

bool RowSurface::keeps(const Vertex& a, const Vertex& b, const Vertex& c,
                       const RowCorner& sample) const {
  const auto area = [&](const Vertex& p, const Vertex& q) {
    return (p.x - sample.x) * (q.y - sample.y) - (p.y - sample.y) * (q.x - sample.x);
  };
  const double at_a = area(b, c), at_b = area(c, a), at_c = area(a, b);
  if (!(at_a >= 0.0 && at_b >= 0.0 && at_c >= 0.0)) return true;
  const double sum = at_a * (a.z - sample.z) + at_b * (b.z - sample.z) + at_c * (c.z - sample.z);
  return std::abs(sum) <= options_.max_error * (at_a + at_b + at_c);
}

std::size_t RowSurface::remove() {
  std::vector<std::uint32_t> triangle_of = triangle_of_vertices(triangles_, vertices_.size());
  Star star;
  PolygonFill fill;
  Vertex ring[kMaxRing];
  RowCorner own{};  // the removed vertex's sample
  const auto left = [&](std::size_t i, std::size_t m, std::size_t j) {
    return turn(ring[i], ring[m], ring[j]) > 0;
  };
  const auto inside = [&](std::size_t i, std::size_t m, std::size_t j, std::size_t p) {
    return in_circle(ring[i], ring[m], ring[j], ring[p]);
  };
  const auto within = [&](std::size_t i, std::size_t m, std::size_t j) {
    return keeps(ring[i], ring[m], ring[j], own) && fits(ring[i], ring[m], ring[j]);
  };
  const auto good = [&](std::size_t i, std::size_t m, std::size_t j) {
    return turn(ring[i], ring[m], ring[j]) > 0 && wide(ring[i], ring[m], ring[j]) &&
           within(i, m, j);
  };
  AnyFill any(good, fill);
  std::size_t count = 0;
  for (std::uint32_t v = fixed_; v < vertices_.size(); ++v) {
    if (triangle_of[v] == kNone || !star.gather(triangles_, v, triangle_of[v])) continue;
    const std::size_t size = star.size();
    own = sample(vertices_[v].sample);
    for (std::size_t i = 0; i < size; ++i) ring[i] = vertices_[star.ring(i)];
    if (!(fill_delaunay(size, left, inside, fill) && star.all_of(fill, within)) &&
        !(size > 3 && any.find(size)))
      continue;
    star.replace(triangles_, fill, triangle_of, v);
    ++count;
  }
  return count;
}

void RowSurface::fit() {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const std::vector<std::uint32_t> triangle_of = triangle_of_vertices(triangles_, vertices_.size());
  for (std::uint32_t v = fixed_; v < vertices_.size(); ++v) {
    if (triangle_of[v] == kNone) continue;
    // visit(b, c) for each triangle v, b, c, until it returns false. No such vertex is on the
    // border.
    const auto around = [&](const auto& visit) {
      std::uint32_t t = triangle_of[v];
      do {
        const Triangle& triangle = triangles_[t];
        const unsigned at = corner_of(triangle, v);
        if (!visit(vertex(triangle, after(at)), vertex(triangle, before(at)))) return false;
        t = triangle.next[after(at)];
      } while (t != triangle_of[v]);
      return true;
    };
    Vertex& own = vertices_[v];
    RowInterval rises{-kFar, kFar};
    around([&](const Vertex& b, const Vertex& c) {
      scan_.narrow(samples_, corner(own), corner(b), corner(c), options_.max_error, rises);
      return rises.low < rises.high;
    });
    // No compromise where nothing satisfies all: it would break the bound.
    if (!(rises.low < rises.high && rises.high - rises.low < kFar)) continue;
    const double before_that = own.z;
    own.z = on_lattice(lattice_, own.z + (rises.low / 2 + rises.high / 2));
    if (!around([&](const Vertex& b, const Vertex& c) { return fits(own, b, c); }))
      own.z = before_that;
  }
}

}  // namespace terrace::tri::tin::rows
