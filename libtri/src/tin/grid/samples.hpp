// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <terrace/base/simd.hpp>

#include "gaps.hpp"
#include "terrace/tri/grid_tin.hpp"
#include "tin/lattice.hpp"
#include "tin/mesh.hpp"
#include "tin/scan.hpp"

namespace terrace::tri::tin {

/// The samples of a window. Coordinates are columns and rows; heights of vertices without data are
/// NaN. Errors are computed in T.
template <class T>
class RasterSamples : public LatticeSamples<RasterSamples<T>, GridCorner<T>> {
 public:
  using Vertex = GridCorner<T>;
  using Sample = GridCorner<T>;
  using RasterMesh = Mesh<std::vector<Vertex>>;
  static constexpr bool kMoved = false;
  static constexpr bool kThinDelaunay = false;

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

  void judge(RasterMesh& mesh, std::uint32_t t) const;
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

}  // namespace terrace::tri::tin
