// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "places.hpp"
#include "scan.hpp"
#include "terrace/tri/point_tin.hpp"
#include "tin/cavity.hpp"
#include "tin/grid/tiles.hpp"
#include "tin/mesh.hpp"
#include "tin/star.hpp"

namespace terrace::tri::tin::rows {

/// A mesh over samples in rows and columns, on a lattice, in an upright rectangle. The sides of the
/// rectangle are kept.
///
/// As with point_tin(), but no triangle has a list of its samples: they are found by their rows and
/// columns, which is several times as fast.
class RowSurface {
 public:
  /// frame: see is_rectangle().
  RowSurface(PaddedSamples padded, std::span<const Point3> frame, const PointTinOptions& options,
             RowPath path);

  /// Inserts samples until all that can become vertices are within the bound: Delaunay.
  void refine();
  /// Puts vertices and triangles that are near each other near each other in memory.
  void arrange();
  /// One pass of removals that keep the bound at all samples. Returns their number.
  std::size_t remove();
  /// One sweep over the vertices: each is moved to the middle of the heights that keep the bound
  /// at the samples of its triangles.
  void fit();
  /// With every sample measured.
  PointTin result();

 private:
  struct Vertex {
    std::int32_t x, y;
    double z;
    std::uint32_t sample;  ///< row << 16 | column; kNone: of the frame
  };
  struct Spot {
    std::uint32_t triangle;  ///< kNone: outside
    bool taken;              ///< a vertex is there
    bool border;             ///< it is on the border
  };

  [[nodiscard]] RowCorner corner(const Vertex& vertex) const {
    return {static_cast<double>(vertex.x), static_cast<double>(vertex.y), vertex.z};
  }
  [[nodiscard]] const Vertex& vertex(const Triangle& triangle, unsigned i) const {
    return vertices_[triangle.corner[i]];
  }
  [[nodiscard]] std::size_t at(std::uint32_t place) const {
    return (place >> 16) * samples_.stride + (place & 0xFFFF);
  }
  [[nodiscard]] RowCorner sample(std::uint32_t place) const;
  [[nodiscard]] Spot locate(const Vertex& p, std::uint32_t triangle) const;
  void start(std::span<const Point3> frame);
  void insert(std::uint32_t vertex, std::uint32_t triangle);
  /// Finds the triangle's worst sample.
  void judge(Triangle& triangle) const;
  [[nodiscard]] bool fits(const Vertex& a, const Vertex& b, const Vertex& c) const;
  [[nodiscard]] bool wide(const Vertex& a, const Vertex& b, const Vertex& c) const;
  /// Whether a triangle keeps the bound at a sample, if it contains it; cheaper than fits().
  [[nodiscard]] bool keeps(const Vertex& a, const Vertex& b, const Vertex& c,
                           const RowCorner& sample) const;
  void measure(PointTin& tin) const;

  const PointTinOptions& options_;
  const TinLattice lattice_;
  double tangent_;  ///< of the smallest angle
  PaddedSamples padded_;
  RowSamples samples_;
  const RowScan& scan_;
  GridTiles tiles_;
  std::uint32_t fixed_ = 0;  ///< vertices of the frame
  std::vector<Vertex> vertices_;
  Triangles triangles_;
  Cavity cavity_;
  /// Samples that cannot become vertices: not seen while vertices are inserted.
  std::vector<std::pair<std::size_t, double>> stuck_;
};

}  // namespace terrace::tri::tin::rows
