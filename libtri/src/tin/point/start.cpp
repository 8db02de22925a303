// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "curve_sort.hpp"
#include "refinement.hpp"
#include "terrace/tri/delaunay2.hpp"
#include "tin/options.hpp"

namespace terrace::tri::tin::points {
namespace {

/// Spreads the bits to every other position.
std::uint32_t spread(std::uint32_t bits) {
  bits = (bits | bits << 8) & 0x00FF00FFu;
  bits = (bits | bits << 4) & 0x0F0F0F0Fu;
  bits = (bits | bits << 2) & 0x33333333u;
  return (bits | bits << 1) & 0x55555555u;
}

/// A raster of 2^16 x 2^16 cells over some samples, along the Z curve.
class Cells {
 public:
  Cells(const double* x, const double* y, std::span<const std::uint32_t> order)
      : x_(x), y_(y), low_{x[order[0]], y[order[0]]} {
    std::array<double, 2> high = low_;
    for (const std::uint32_t i : order) {
      low_ = {std::min(low_[0], x[i]), std::min(low_[1], y[i])};
      high = {std::max(high[0], x[i]), std::max(high[1], y[i])};
    }
    extent_ = std::max(high[0] - low_[0], high[1] - low_[1]);
  }
  [[nodiscard]] bool single() const { return !(extent_ > 0); }
  [[nodiscard]] std::uint32_t key(std::uint32_t i) const {
    return spread(cell(x_[i], low_[0])) | spread(cell(y_[i], low_[1])) << 1;
  }

 private:
  [[nodiscard]] std::uint32_t cell(double c, double low) const {
    const double part = (c - low) / extent_ * 65536;
    return part < 65535 ? static_cast<std::uint32_t>(part) : 65535;
  }

  const double* x_;
  const double* y_;
  std::array<double, 2> low_;
  double extent_ = 0;
};

double merged_height(std::span<const Sample> group, PointDuplicates duplicates) {
  double height = group[0].z;
  if (duplicates == PointDuplicates::min || duplicates == PointDuplicates::max) {
    for (const Sample& sample : group)
      height = duplicates == PointDuplicates::min ? std::min(height, sample.z)
                                                  : std::max(height, sample.z);
  } else if (duplicates == PointDuplicates::mean) {
    // Adds differences from the first height, so that equal heights are preserved exactly.
    double sum = 0;
    for (const Sample& sample : group) sum += sample.z - group[0].z;
    height += sum / static_cast<double>(group.size());
  }
  return height;
}

void check(std::span<const double> values, const char* name) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!(std::abs(values[i]) < kLargest))
      throw std::invalid_argument(std::string("point_tin: ") + name + " of sample " +
                                  std::to_string(i) + " is not finite or too large");
}

/// Triangulates the vertices present.
void triangulate(PointMesh& mesh) {
  std::vector<Place2> points;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v)
    points.push_back(place(mesh.vertices[v]));
  Delaunay2<double> delaunay;
  const std::vector<VertexId> ids = delaunay.build(points);
  std::vector<std::uint32_t> vertex_of(delaunay.vertex_slots(), kNone);
  for (std::uint32_t v = 0; v < ids.size(); ++v) vertex_of[slot(ids[v])] = v;
  std::vector<std::uint32_t> triangle_of(delaunay.triangle_slots(), kNone);
  std::uint32_t count = 0;
  for (const TriangleId t : delaunay.all_triangles()) triangle_of[slot(t)] = count++;
  for (const TriangleId t : delaunay.all_triangles()) {
    Triangle triangle{{}, {}, kNone, 0.0F};
    const auto corners = delaunay.vertices(t);
    const auto neighbours = delaunay.neighbours(t);
    for (std::size_t i = 0; i < 3; ++i) {
      triangle.corner[i] = vertex_of[slot(corners[i])];
      triangle.next[i] = neighbours[i] == kNoTriangle ? kNone : triangle_of[slot(neighbours[i])];
    }
    mesh.triangles.push_back(triangle);
  }
}

bool lexicographically_less(const Place2& a, const Place2& b) {
  return a[0] != b[0] ? a[0] < b[0] : a[1] < b[1];
}

[[noreturn]] void refuse_frame(std::size_t i, const char* reason) {
  throw std::invalid_argument("point_tin: vertex " + std::to_string(i) + " of the frame " + reason);
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

SampleList prepare_samples(std::span<const double> x, std::span<const double> y,
                           std::span<const double> z, PointDuplicates duplicates) {
  if (x.size() != y.size() || x.size() != z.size())
    throw std::invalid_argument("point_tin: x, y and z must have equal lengths");
  if (x.size() > std::size_t{1} << 29) throw std::length_error("point_tin: more than 2^29 samples");
  check(x, "x");
  check(y, "y");
  check(z, "z");
  SampleList samples;
  const auto count = static_cast<std::uint32_t>(x.size());
  if (count == 0) return samples;
  Pool<std::uint32_t> numbers;
  numbers.resize(count);
  const std::span<std::uint32_t> order = span_of(numbers);
  std::iota(order.begin(), order.end(), 0u);
  // Samples at one position become adjacent, the smaller number first.
  sort_along_curve<32>(
      order, [&](std::span<const std::uint32_t> part) { return Cells(x.data(), y.data(), part); },
      1,
      [&](std::span<std::uint32_t> run) {
        std::sort(run.begin(), run.end(), [&](std::uint32_t a, std::uint32_t b) {
          if (x[a] != x[b]) return x[a] < x[b];
          if (y[a] != y[b]) return y[a] < y[b];
          return a < b;
        });
      });
  Pool<Sample>& all = samples.all;
  all.resize(count);
  for (std::uint32_t k = 0; k < count; ++k) {
    const std::uint32_t i = order[k];
    all[k] = {x[i], y[i], z[i], kUnlisted, i};
  }
  numbers.release();
  std::uint32_t unique_count = 0;
  for (std::uint32_t begin = 0; begin < count;) {
    Sample first = all[begin];
    std::uint32_t end = begin + 1;
    while (end < count && all[end].x == first.x && all[end].y == first.y) ++end;
    if (end - begin > 1 && duplicates == PointDuplicates::error)
      throw std::invalid_argument("point_tin: sample " + std::to_string(all[begin + 1].id) +
                                  " is at the position of sample " + std::to_string(first.id));
    if (end - begin == 1) {
      all[unique_count++] = first;
      begin = end;
      continue;
    }
    const std::span<Sample> group = span_of(all).subspan(begin, end - begin);
    const auto [low, high] = std::minmax_element(
        group.begin(), group.end(), [](const Sample& a, const Sample& b) { return a.z < b.z; });
    const Sample lowest = *low, highest = *high;
    samples.duplicates += group.size() - 1;
    samples.duplicate_range = std::max(samples.duplicate_range, highest.z - lowest.z);
    if (duplicates == PointDuplicates::all) {
      // Once one of them is a vertex, the other cannot become one, because its position is taken.
      all[unique_count++] = lowest;
      if (highest.z > lowest.z) all[unique_count++] = highest;
    } else {
      first.z = merged_height(group, duplicates);
      all[unique_count++] = first;
    }
    begin = end;
  }
  all.resize(unique_count);
  return samples;
}

PointMesh start_with_frame(std::span<const Point3> frame) {
  if (frame.size() < 3) throw std::invalid_argument("point_tin: a frame needs at least 3 vertices");
  PointMesh mesh;
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
    const Place2 previous = place(mesh.vertices[i == 0 ? count - 1 : i - 1]);
    const Place2 current = place(mesh.vertices[i]);
    const Place2 next = place(mesh.vertices[i + 1 == count ? 0 : i + 1]);
    if (current == next) refuse_frame(i, "coincides with the next");
    const int side = Kernel::orientation(previous, current, next);
    const bool turns_back =
        lexicographically_less(previous, current) != lexicographically_less(current, next);
    if (side < 0 || (side == 0 && turns_back))
      refuse_frame(i, "makes the frame non-convex or clockwise");
    bends = bends || side > 0;
    turns += turns_back ? 1 : 0;
  }
  if (!bends || turns != 2)
    throw std::invalid_argument("point_tin: the frame goes around more than once");
  triangulate(mesh);
  return mesh;
}

PointMesh start_with_hull(Pool<Sample>& samples) {
  PointMesh mesh;
  const std::uint32_t count = samples.size();
  if (count < 3) return mesh;
  const auto at = [&](std::uint32_t i) { return place(samples[i]); };
  const auto less = [&](std::uint32_t a, std::uint32_t b) {
    return lexicographically_less(at(a), at(b));
  };
  // The extremes in 16 directions form a polygon. Points strictly inside it are not corners.
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
  const std::vector<std::uint32_t> inner = hull_of(candidates, at);
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
      inside = Kernel::orientation(at(inner[k]), at(inner[(k + 1) % inner.size()]), at(i)) > 0;
    if (!inside) candidates.push_back(i);
  }
  std::sort(candidates.begin(), candidates.end(), less);
  const std::vector<std::uint32_t> hull = hull_of(candidates, at);
  if (hull.size() < 3) return mesh;
  for (const std::uint32_t i : hull) {
    mesh.vertices.push_back({samples[i].x, samples[i].y, samples[i].z, i});
    samples[i].next = kIsVertex;
  }
  triangulate(mesh);
  return mesh;
}

}  // namespace terrace::tri::tin::points
