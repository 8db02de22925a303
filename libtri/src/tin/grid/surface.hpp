// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "gaps.hpp"
#include "scan.hpp"
#include "terrace/tri/grid_tin.hpp"
#include "tiles.hpp"
#include "tin/cavity.hpp"
#include "tin/ground.hpp"
#include "tin/mesh.hpp"

namespace terrace::tri::tin {

/// A triangulation of a window while it is being made. T: what errors are computed in.
template <class T>
class GridSurface {
 public:
  /// `sides_fixed`: no vertex is put on the window's sides but by insert_sides().
  template <class Sample>
  GridSurface(const GridWindow<Sample>& window, const GridTinOptions& options, bool sides_fixed,
              GridPath path);

  void insert_sides(const GridSides& sides);
  /// Inserts samples until none is worse than the bound or there are `most` vertices with data.
  /// Queue: ErrorBuckets or ErrorHeap.
  template <class Queue>
  void refine(std::size_t most);
  /// Brings vertices and triangles that are near each other in the plane near each other in memory.
  void arrange();
  /// Removes inner vertices where the bound still holds without them, in the order of their
  /// numbers.
  void remove();
  /// Moves heights of inner vertices to the middle of what the samples around them allow.
  void fit();

  GridTin result() const;  ///< with row and column steps of the options, not measured

 private:
  using Corner = GridCorner<T>;

  const Corner& corner(const Triangle& triangle, unsigned i) const {
    return corners_[triangle.corner[i]];
  }
  bool sees(const Corner& a) const { return a.z == a.z; }
  bool sees_all(const Corner& a, const Corner& b, const Corner& c) const {
    return sees(a) && sees(b) && sees(c);
  }

  void make_coarse();
  std::uint32_t add_vertex(std::int32_t x, std::int32_t y);
  /// The triangle that contains a sample, found by walking from triangle t.
  std::uint32_t locate(std::int32_t x, std::int32_t y, std::uint32_t t) const;
  /// Inserts a sample that lies in triangle t. The triangles made are cavity_.created().
  void insert(std::int32_t x, std::int32_t y, std::uint32_t t);
  /// Sets the triangle's place and error.
  void judge(Triangle& triangle) const;
  GridWorst<T> worst(const Corner& a, const Corner& b, const Corner& c) const;
  /// The same, or one that is bad enough.
  GridWorst<T> worst_to_insert(const Corner& a, const Corner& b, const Corner& c) const;
  /// Whether a triangle may help to fill the star of `removed`: within the bound,
  /// counter-clockwise, not thin, not mixed.
  bool fits(const Corner& a, const Corner& b, const Corner& c, const Corner& removed) const;
  void fit_vertex(std::uint32_t vertex, std::uint32_t first);

  std::int32_t columns_, rows_;
  bool rows_turned_;  ///< counter-clockwise on the lattice is clockwise on the ground
  bool sides_fixed_;
  GridTiles tiles_;
  double bound_;
  T scan_bound_;  ///< bound_, rounded down
  Ground ground_;
  const GridScan<T>& scan_;
  std::vector<T> heights_, coarse_heights_;
  GridSamples<T> samples_, coarse_;  ///< all, and those of every kGridCoarse-th column and row
  bool coarse_first_ = false;        ///< large triangles are judged by coarse_, if it suffices
  std::optional<GridGaps> gaps_;
  std::vector<Corner> corners_;
  Triangles triangles_;
  Cavity cavity_;
};

}  // namespace terrace::tri::tin
