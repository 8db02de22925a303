// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <terrace/base/simd.hpp>

#include "delaunay2/int_kernel.hpp"
#include "delaunay2/predicates.hpp"
#include "terrace/tri/grid_tin.hpp"
#include "tin/ground.hpp"
#include "tin/lattice.hpp"
#include "tin/mesh.hpp"
#include "tin/scan.hpp"

namespace terrace::tri::tin {

/// Handles missing data in a window. The whole window is triangulated, including samples without
/// data, until no triangle is mixed. Then triangles that have a corner without data are dropped. A
/// triangle is mixed if
/// - its corners have data, but not all samples in it do, or
/// - a corner has no data, but the triangle contains (perhaps as a corner) an *inner* sample: one
///   with data whose 8 neighbours have data too.
/// Each inner sample is therefore only in triangles with data. The boundary may run through the
/// other samples with data, the *shore*.
class GridGaps {
 public:
  /// A NaN height marks missing data.
  template <class T>
  GridGaps(const GridSamples<T>& samples, std::int32_t columns, std::int32_t rows);

  /// Marks a sample as a vertex. Samples are identified by place_at().
  void take(std::uint32_t place) { flags_[index(place)] |= kVertex; }
  bool is_vertex(std::uint32_t place) const { return (flags_[index(place)] & kVertex) != 0; }

  /// True if the triangle, which has at least one corner without data, is mixed.
  template <class T>
  bool mixed(const GridCorner<T>& a, const GridCorner<T>& b, const GridCorner<T>& c) const;

  /// The sample whose insertion resolves a mixed triangle: the one deepest inside it, preferably on
  /// the shore or next to it. kNone if the samples' range has none.
  template <class T>
  std::uint32_t sample_to_insert(const GridSamples<T>& samples, const Ground& ground,
                                 const GridCorner<T>& a, const GridCorner<T>& b,
                                 const GridCorner<T>& c) const;

 private:
  static constexpr std::uint8_t kMissing = 1, kInner = 2, kVertex = 4, kCoastal = 8;
  std::size_t index(std::int32_t x, std::int32_t y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(x);
  }
  std::size_t index(std::uint32_t place) const { return index(column_of(place), row_of(place)); }
  template <class T>
  std::uint32_t neighbour_of_inner(const GridSamples<T>& samples, const Ground& ground,
                                   const GridCorner<T>* const (&corners)[3]) const;

  std::int32_t columns_;
  std::vector<std::uint8_t> flags_;
  std::vector<std::uint16_t> inner_counts_;  ///< inner samples to the left, columns + 1 per row
};

/// The samples of a window. Coordinates are columns and rows. Heights of vertices without data are
/// NaN. Errors are computed in T.
template <class T>
class RasterSamples : public LatticeSamples<RasterSamples<T>, GridCorner<T>> {
 public:
  using Vertex = GridCorner<T>;
  using Sample = GridCorner<T>;
  using RasterMesh = Mesh<std::vector<Vertex>>;
  static constexpr bool kMovesVertices = false;
  static constexpr Fills kFills = Fills::wide;

  /// `sides_fixed`: samples on the window's sides are not tested and do not become vertices.
  template <class Height>
  RasterSamples(const GridWindow<Height>& window, const GridTinOptions& options, bool sides_fixed,
                base::SimdPath set);
  RasterSamples(RasterSamples&&) = default;

  /// From now on, in large triangles, a sample of every kGridCoarse-th column and row that is
  /// beyond the bound is good enough to insert.
  void judge_coarsely_first();

  std::int32_t columns() const { return columns_; }
  std::int32_t rows() const { return rows_; }
  float least_error() const { return static_cast<float>(bound_); }
  bool border_fixed() const { return sides_fixed_; }

  void set_error(RasterMesh& mesh, std::uint32_t t) const;
  bool open(std::uint32_t place) const;
  Vertex take(std::uint32_t place);
  void give_up(std::uint32_t) {}
  void restore() {}
  bool counts(const Vertex& vertex) const { return vertex.z == vertex.z; }
  std::uint32_t place_of(const Vertex& vertex) const;
  Sample sample_of(const Vertex& vertex) const;
  bool within(const RasterMesh&, std::uint32_t, const Vertex& a, const Vertex& b,
              const Vertex& c) const {
    return within(a, b, c);
  }
  bool fits(const Vertex& a, const Vertex& b, const Vertex& c, const Sample& removed) const;
  void narrow(std::uint32_t t, const Vertex& v, const Vertex& b, const Vertex& c,
              Interval& rises) const;
  bool raise(Vertex& v, const Interval& rises) const;
  bool covers(const Vertex& a, const Vertex& b, const Vertex& c) const;
  void publish(const Vertex& vertex, GridTin& tin) const;

 private:
  bool within(const Vertex& a, const Vertex& b, const Vertex& c) const;
  WorstSample<T> worst(const Vertex& a, const Vertex& b, const Vertex& c) const;
  /// The worst sample, or one that is good enough.
  WorstSample<T> worst_to_insert(const Vertex& a, const Vertex& b, const Vertex& c) const;

  std::int32_t columns_, rows_;
  bool sides_fixed_;
  double bound_;
  T scan_bound_;  ///< bound_, rounded down
  const GridScan<T>& scan_;
  std::vector<T> heights_, coarse_heights_;
  GridSamples<T> samples_;
  GridSamples<T> coarse_{};  ///< those of every kGridCoarse-th column and row
  std::optional<GridGaps> gaps_;
};

/// The samples of a window for a mesh that remains the canonical Delaunay triangulation of its
/// vertices: that of Delaunay2<std::int32_t> for points (column, row).
template <class T>
class CanonicalSamples : public RasterSamples<T> {
 public:
  using Vertex = typename RasterSamples<T>::Vertex;
  using Hole = LatticeHole<CanonicalSamples>;
  static constexpr Fills kFills = Fills::delaunay;

  using RasterSamples<T>::RasterSamples;

  static bool in_circle(const Vertex& a, const Vertex& b, const Vertex& c, const Vertex& p) {
    return planar::inside_circle<planar::IntKernel>({a.x, a.y}, {b.x, b.y}, {c.x, c.y}, {p.x, p.y});
  }
};

}  // namespace terrace::tri::tin
