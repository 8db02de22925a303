// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "error_queue.hpp"
#include "ground.hpp"
#include "mesh.hpp"
#include "refinement.hpp"
#include "terrace/tri/grid_tin.hpp"

/// Meshes of samples in rows and columns, with vertices at integer coordinates in an axis-parallel
/// rectangle. The samples in a triangle are found by their rows and columns.

namespace terrace::tri::tin {

/// Squares of 32 x 32 samples, small enough for the triangles of one to fit into the first-level
/// cache. Numbered boustrophedon, so that each is next to the previous one.
class Tiles {
 public:
  Tiles(std::int32_t columns, std::int32_t rows)
      : tile_columns_((columns >> kBits) + 1), tile_rows_((rows >> kBits) + 1) {}

  std::size_t count() const {
    return static_cast<std::size_t>(tile_columns_) * static_cast<std::size_t>(tile_rows_);
  }
  std::uint32_t of(std::uint32_t place) const {
    const std::int32_t row = row_of(place) >> kBits, column = column_of(place) >> kBits;
    return static_cast<std::uint32_t>(row * tile_columns_ +
                                      (row % 2 == 0 ? column : tile_columns_ - 1 - column));
  }

 private:
  static constexpr int kBits = 5;
  std::int32_t tile_columns_, tile_rows_;
};

/// True if a triangle is within the bound at one sample, or does not contain it. Most triangles
/// that cannot replace a vertex fail at that vertex's own sample.
template <class Vertex, class Sample>
bool within_at(const Vertex& a, const Vertex& b, const Vertex& c, const Sample& sample,
               double bound) {
  using Wide = std::conditional_t<std::is_integral_v<decltype(sample.x)>, std::int64_t, double>;
  const auto area = [&](const Vertex& p, const Vertex& q) {
    return Wide{p.x - sample.x} * (q.y - sample.y) - Wide{p.y - sample.y} * (q.x - sample.x);
  };
  const Wide at_a = area(b, c), at_b = area(c, a), at_c = area(a, b);
  if (!(at_a >= 0 && at_b >= 0 && at_c >= 0)) return true;
  const double sum = static_cast<double>(at_a) * static_cast<double>(a.z - sample.z) +
                     static_cast<double>(at_b) * static_cast<double>(b.z - sample.z) +
                     static_cast<double>(at_c) * static_cast<double>(c.z - sample.z);
  return std::fabs(sum) <= bound * static_cast<double>(at_a + at_b + at_c);
}

/// The triangles that may replace those of a removed vertex.
enum class Fills {
  wide,              ///< any without small angles
  wide_or_delaunay,  ///< these, or the Delaunay triangles
  delaunay,          ///< the Delaunay triangles alone
};

/// A VertexHole over LatticeSamples.
template <class S>
class LatticeHole {
 public:
  explicit LatticeHole(const S& samples) : samples_(samples) {}

  bool gather(const Mesh<typename S::Vertices>& mesh, const Star& star, std::uint32_t v) {
    removed_ = samples_.sample_of(mesh.vertices[v]);
    size_ = star.size();
    for (std::size_t i = 0; i < size_; ++i) ring_[i] = mesh.vertices[star.ring(i)];
    return true;
  }
  bool left(std::size_t i, std::size_t m, std::size_t j) const {
    return turn(ring_[i], ring_[m], ring_[j]) > 0;
  }
  bool inside(std::size_t i, std::size_t m, std::size_t j, std::size_t p) const {
    return samples_.in_circle(ring_[i], ring_[m], ring_[j], ring_[p]);
  }
  bool fits(std::size_t i, std::size_t m, std::size_t j) const {
    if constexpr (S::kFills == Fills::wide) return fits_and_wide(i, m, j);
    return samples_.fits(ring_[i], ring_[m], ring_[j], removed_);
  }
  bool fill_otherwise(PolygonFill& fill) const {
    if constexpr (S::kFills == Fills::delaunay) return false;
    const auto fits = [&](std::size_t i, std::size_t m, std::size_t j) {
      return fits_and_wide(i, m, j);
    };
    return size_ > 3 && AnyFill(fits, fill).find(size_);
  }
  static void replaced(const Mesh<typename S::Vertices>&, const Star&, const PolygonFill&) {}

 private:
  bool fits_and_wide(std::size_t i, std::size_t m, std::size_t j) const {
    const std::int64_t twice = turn(ring_[i], ring_[m], ring_[j]);
    return twice > 0 && samples_.ground().has_wide_angles(ring_[i], ring_[m], ring_[j], twice) &&
           samples_.fits(ring_[i], ring_[m], ring_[j], removed_);
  }

  const S& samples_;
  std::array<typename S::Vertex, kMaxRing> ring_;
  typename S::Sample removed_{};
  std::size_t size_ = 0;
};

/// The common part of the kinds of samples in rows and columns. `Own`, derived from this, is
/// RasterSamples or PlacedSamples. Besides the answers that tin::Samples lists, it has
/// - Sample: x, y and z of a sample. sample_of(vertex), and place_of(vertex).
/// - columns(), rows().
/// - least_error(): smaller errors need not be ordered.
/// - kFills: what removal may leave.
/// - fits(a, b, c, removed): true if the triangle may help to fill the hole of a removed vertex,
///   given that vertex's sample.
template <class Own, class OwnVertex>
class LatticeSamples {
 public:
  using Vertex = OwnVertex;
  using Vertices = std::vector<Vertex>;
  using Hole = LatticeHole<Own>;
  using FirstSide = LowestSide;
  static constexpr std::size_t kMaxFittedTriangles = std::numeric_limits<std::size_t>::max();

  explicit LatticeSamples(const Ground& ground) : ground_(ground) {}

  const Ground& ground() const { return ground_; }
  static std::int64_t turn(const Vertex& a, const Vertex& b, const Vertex& p) {
    return tin::turn(a, b, p);
  }
  bool in_circle(const Vertex& a, const Vertex& b, const Vertex& c, const Vertex& p) const {
    return ground_.in_circle(a, b, c, p);
  }

  void split(Mesh<Vertices>& mesh, std::span<const std::uint32_t> created, std::uint32_t,
             std::uint32_t, const Spot&) {
    for (const std::uint32_t t : created) static_cast<Own&>(*this).set_error(mesh, t);
  }

 private:
  Ground ground_;
};

/// Starts with the two triangles of a rectangle and inserts the other vertices on its sides.
/// `frame`: vertices on the sides, counter-clockwise, including the four corners.
template <class S>
Refinement<S> start_in_rectangle(S samples, std::vector<typename S::Vertex> frame,
                                 base::StopCheck check_stop) {
  using Vertex = typename S::Vertex;
  Vertex low = frame[0], high = frame[0];
  for (const Vertex& p : frame) {
    low.x = std::min(low.x, p.x), high.x = std::max(high.x, p.x);
    low.y = std::min(low.y, p.y), high.y = std::max(high.y, p.y);
  }
  const auto is_corner = [&](const Vertex& p) {
    return (p.x == low.x || p.x == high.x) && (p.y == low.y || p.y == high.y);
  };
  std::array<std::uint32_t, 4> corner{};
  std::size_t corners = 0;
  for (std::uint32_t v = 0; v < frame.size(); ++v)
    if (is_corner(frame[v])) corner[corners++] = v;
  // The corners are cocircular, so either diagonal is right unless in_circle() breaks ties.
  if (samples.in_circle(frame[corner[0]], frame[corner[1]], frame[corner[2]], frame[corner[3]]))
    std::rotate(corner.begin(), corner.begin() + 1, corner.end());
  Refinement<S> refinement(std::move(samples),
                           {std::move(frame),
                            {{{corner[0], corner[1], corner[2]}, {kNone, 1, kNone}, 0, 0.0F},
                             {{corner[0], corner[2], corner[3]}, {kNone, kNone, 0}, 0, 0.0F}}},
                           std::move(check_stop));
  std::uint32_t near = 0;
  for (std::uint32_t v = 0; v < refinement.mesh().vertices.size(); ++v) {
    const Vertex p = refinement.mesh().vertices[v];
    if (!is_corner(p)) near = refinement.insert(v, refinement.locate(p, near)).front();
  }
  return refinement;
}

/// The positions of elements after sorting by key, a number below `count`. Equal keys keep their
/// order.
inline std::vector<std::uint32_t> sorted_by(const std::vector<std::uint32_t>& keys,
                                            std::size_t count) {
  std::vector<std::uint32_t> starts(count + 1, 0);
  for (const std::uint32_t key : keys) ++starts[key + 1];
  for (std::size_t i = 1; i <= count; ++i) starts[i] += starts[i - 1];
  std::vector<std::uint32_t> places;
  places.reserve(keys.size());
  for (const std::uint32_t key : keys) places.push_back(starts[key]++);
  return places;
}

/// Reorders vertices and triangles so that those close to each other in the plane are close in
/// memory. The first `first` vertices stay first.
template <class S>
void arrange(Refinement<S>& refinement, std::size_t first) {
  auto& [vertices, triangles] = refinement.mesh();
  const S& samples = refinement.samples();
  const Tiles tiles(samples.columns(), samples.rows());
  std::vector<std::uint32_t> keys;
  keys.reserve(triangles.size());
  const auto tile_of = [&](const auto& v) { return tiles.of(samples.place_of(v)); };
  for (std::size_t v = 0; v < vertices.size(); ++v)
    keys.push_back(v < first ? 0 : tile_of(vertices[v]) + 1);
  const std::vector<std::uint32_t> vertex_at = sorted_by(keys, tiles.count() + 1);
  keys.clear();
  for (const Triangle& triangle : triangles) keys.push_back(tile_of(vertices[triangle.corner[0]]));
  const std::vector<std::uint32_t> triangle_at = sorted_by(keys, tiles.count());
  std::vector<typename S::Vertex> sorted_vertices(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) sorted_vertices[vertex_at[i]] = vertices[i];
  vertices.swap(sorted_vertices);
  Triangles sorted_triangles(triangles.size());
  for (std::size_t i = 0; i < sorted_triangles.size(); ++i) {
    Triangle& triangle = sorted_triangles[triangle_at[i]] = triangles[i];
    for (std::uint32_t& corner : triangle.corner) corner = vertex_at[corner];
    for (std::uint32_t& next : triangle.next)
      if (next != kNone) next = triangle_at[next];
  }
  triangles.swap(sorted_triangles);
}

/// Refines to the bound and applies the steps of the quality. The first `first` vertices stay
/// first.
template <class S>
void refine_to_bound(Refinement<S>& refinement, TinQuality quality, std::size_t first) {
  const S& samples = refinement.samples();
  {
    ErrorBuckets queue(samples.least_error(), Tiles(samples.columns(), samples.rows()));
    refinement.judge_all(queue);
    refinement.refine(queue);
  }
  if (quality == TinQuality::greedy) return;
  arrange(refinement, first);
  refinement.remove();
  if (quality == TinQuality::removal) return;
  refinement.fit();
  refinement.remove();
}

}  // namespace terrace::tri::tin
