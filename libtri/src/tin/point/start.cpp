// SPDX-License-Identifier: Apache-2.0
#include "start.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "terrace/tri/delaunay2.hpp"

namespace terrace::tri::tin::points {
namespace {

/// Triangulates the vertices present.
void triangulate(Mesh& mesh) {
  std::vector<Place2> points;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) points.push_back(mesh.place(v));
  Delaunay2<double> delaunay;
  const std::vector<VertexId> ids = delaunay.build(points);
  std::vector<std::uint32_t> vertex_of(delaunay.vertex_slots(), kNone);
  for (std::uint32_t v = 0; v < ids.size(); ++v) vertex_of[slot(ids[v])] = v;
  std::vector<std::uint32_t> triangle_of(delaunay.triangle_slots(), kNone);
  std::uint32_t count = 0;
  for (const TriangleId t : delaunay.all_triangles()) triangle_of[slot(t)] = count++;
  for (const TriangleId t : delaunay.all_triangles()) {
    Triangle made{{}, {}, kNone, 0.0F};
    const auto corners = delaunay.vertices(t);
    const auto neighbours = delaunay.neighbours(t);
    for (std::size_t i = 0; i < 3; ++i) {
      made.corner[i] = vertex_of[slot(corners[i])];
      made.next[i] = neighbours[i] == kNoTriangle ? kNone : triangle_of[slot(neighbours[i])];
    }
    mesh.triangles.push_back(made);
    mesh.heads.push_back(kNone);
  }
}

bool lexicographically_less(const Place2& a, const Place2& b) {
  return a[0] != b[0] ? a[0] < b[0] : a[1] < b[1];
}

[[noreturn]] void refuse_frame(std::size_t i, const char* why) {
  throw std::invalid_argument("point_tin: vertex " + std::to_string(i) + " of the frame " + why);
}

/// Corners of the hull, counter-clockwise, of points sorted by x, then y.
template <class PlaceOf>
std::vector<std::uint32_t> hull_of(const std::vector<std::uint32_t>& sorted, PlaceOf place) {
  std::vector<std::uint32_t> hull;
  const auto add = [&](std::uint32_t p, std::size_t base) {
    while (hull.size() >= base + 2 &&
           Kernel::orientation(place(hull[hull.size() - 2]), place(hull.back()), place(p)) <= 0)
      hull.pop_back();
    hull.push_back(p);
  };
  for (const std::uint32_t p : sorted) add(p, 0);
  const std::size_t base = hull.size() - 1;
  for (std::size_t i = sorted.size() - 1; i-- > 0;) add(sorted[i], base);
  hull.pop_back();
  return hull;
}

}  // namespace

void start_with_frame(Mesh& mesh, std::span<const Point3> frame) {
  if (frame.size() < 3) throw std::invalid_argument("point_tin: a frame needs at least 3 vertices");
  for (std::size_t i = 0; i < frame.size(); ++i) {
    for (const double c : frame[i])
      if (!(std::abs(c) < kLargest)) refuse_frame(i, "is not finite or too large");
    mesh.vertices.push_back({frame[i][0], frame[i][1], frame[i][2], kNone});
  }
  // The frame is convex everywhere and goes around once if the lexicographic order rises once and
  // falls once.
  const auto count = static_cast<std::uint32_t>(frame.size());
  std::size_t turns = 0;
  bool bends = false;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Place2 before = mesh.place(i == 0 ? count - 1 : i - 1);
    const Place2 here = mesh.place(i);
    const Place2 after = mesh.place(i + 1 == count ? 0 : i + 1);
    if (here == after) refuse_frame(i, "coincides with the next");
    const int side = Kernel::orientation(before, here, after);
    const bool turns_back =
        lexicographically_less(before, here) != lexicographically_less(here, after);
    if (side < 0 || (side == 0 && turns_back))
      refuse_frame(i, "makes the frame non-convex or clockwise");
    bends = bends || side > 0;
    turns += turns_back ? 1 : 0;
  }
  if (!bends || turns != 2)
    throw std::invalid_argument("point_tin: the frame goes around more than once");
  triangulate(mesh);
}

void start_with_hull(Mesh& mesh) {
  Pool<Sample>& samples = *mesh.samples;
  const std::uint32_t count = samples.size();
  if (count < 3) return;
  const auto place = [&](std::uint32_t i) { return Place2{samples[i].x, samples[i].y}; };
  const auto less = [&](std::uint32_t a, std::uint32_t b) {
    return lexicographically_less(place(a), place(b));
  };
  // The extremes in 16 directions form a polygon; points strictly inside it are not corners.
  constexpr std::array<Place2, 8> kDirections{
      {{8, 0}, {7, 3}, {6, 6}, {3, 7}, {0, 8}, {-3, 7}, {-6, 6}, {-7, 3}}};
  std::array<double, 16> best;
  best.fill(-HUGE_VAL);
  std::array<std::uint32_t, 16> extreme{};
  for (std::uint32_t i = 0; i < count; ++i) {
    for (std::size_t d = 0; d < 8; ++d) {
      const double value = kDirections[d][0] * samples[i].x + kDirections[d][1] * samples[i].y;
      if (value > best[d]) {
        best[d] = value;
        extreme[d] = i;
      }
      if (-value > best[d + 8]) {
        best[d + 8] = -value;
        extreme[d + 8] = i;
      }
    }
  }
  std::vector<std::uint32_t> candidates(extreme.begin(), extreme.end());
  std::sort(candidates.begin(), candidates.end(), less);
  candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
  const std::vector<std::uint32_t> inner = hull_of(candidates, place);
  candidates.clear();
  // Most points are recognised at once as between four of the extremes, one in each quadrant around
  // them.
  const Sample& ne = samples[extreme[2]];
  const Sample& nw = samples[extreme[6]];
  const Sample& sw = samples[extreme[10]];
  const Sample& se = samples[extreme[14]];
  const Place2 low{std::max(nw.x, sw.x), std::max(sw.y, se.y)};
  const Place2 high{std::min(ne.x, se.x), std::min(ne.y, nw.y)};
  for (std::uint32_t i = 0; i < count; ++i) {
    const Sample& sample = samples[i];
    if (sample.x > low[0] && sample.x < high[0] && sample.y > low[1] && sample.y < high[1])
      continue;
    bool inside = inner.size() >= 3;
    for (std::size_t k = 0; k < inner.size() && inside; ++k)
      inside =
          Kernel::orientation(place(inner[k]), place(inner[(k + 1) % inner.size()]), place(i)) > 0;
    if (!inside) candidates.push_back(i);
  }
  std::sort(candidates.begin(), candidates.end(), less);
  const std::vector<std::uint32_t> hull = hull_of(candidates, place);
  if (hull.size() < 3) return;
  for (const std::uint32_t i : hull) {
    mesh.vertices.push_back({samples[i].x, samples[i].y, samples[i].z, i});
    samples[i].next = kIsVertex;
  }
  triangulate(mesh);
}

}  // namespace terrace::tri::tin::points
