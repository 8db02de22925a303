// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh.hpp"
#include "samples.hpp"
#include "tin/star.hpp"

namespace terrace::tri::tin::points {

/// The star of a vertex and the samples in it, see VertexHole. Positions are relative to the
/// vertex.
class PointHole {
 public:
  explicit PointHole(PointSamples& samples) : all_(samples) {}

  bool gather(const PointMesh& mesh, const Star& star, std::uint32_t v);
  bool left(std::size_t i, std::size_t m, std::size_t j) const {
    return all_.left(corner(i), corner(m), corner(j));
  }
  bool inside(std::size_t i, std::size_t m, std::size_t j, std::size_t p) const {
    return all_.in_circle(corner(i), corner(m), corner(j), corner(p));
  }
  bool fits(std::size_t i, std::size_t m, std::size_t j) {
    return worst(i, m, j, all_.bound()) <= all_.bound();
  }
  /// Finds the triangles of least worst error whose angles are not too small.
  bool fill_otherwise(PolygonFill& fill);
  void replaced(const PointMesh& mesh, const Star& star, const PolygonFill& fill);

 private:
  const Vertex& corner(std::size_t i) const { return mesh_->vertices[star_->ring(i)]; }
  /// True if no triangle of corners of the ring comes within the bound of a sample, so that no fill
  /// does. False if this is not known or there is no such sample.
  [[nodiscard]] bool out_of_reach(std::size_t sample) const;
  /// The largest error of the samples in the triangle of corners i < m < j of the ring. Infinity if
  /// an error is above `limit` or doubles cannot resolve the triangle's plane.
  double worst(std::size_t i, std::size_t m, std::size_t j, double limit);
  /// True if the triangle's smallest angle is not too small.
  [[nodiscard]] bool wide(std::size_t i, std::size_t m, std::size_t j) const;
  /// The samples left and right of the line from corner i to j, a bit for each sample; both bits
  /// are set on the line.
  struct Sides {
    const std::uint64_t* left;
    const std::uint64_t* right;
  };
  Sides sides(std::size_t i, std::size_t j);
  [[nodiscard]] double error_at(const Plane& plane, const Vertex& a, std::size_t sample) const;
  [[nodiscard]] double cross_at(std::size_t i, std::size_t j, std::size_t sample) const;
  void list_rest(const Star& star, const PolygonFill& fill, std::size_t sample);

  PointSamples& all_;
  const PointMesh* mesh_ = nullptr;
  const Star* star_ = nullptr;
  std::vector<Vertex> ring_;  ///< relative to the centre, including heights
  std::vector<double> x_, y_, z_;
  std::vector<std::uint32_t> index_;
  /// The sample from which the centre was made, and the one that was last found beyond the limit;
  /// index_.size(): none.
  std::size_t own_ = 0, beyond_ = 0;
  std::size_t words_ = 0;                      ///< number of words with a bit for each sample
  std::array<std::uint16_t, kMaxRing> known_;  ///< [i]: bit j if the sides of i and j are known
  std::vector<std::uint64_t> sides_;           ///< left and right of all pairs of corners
  std::vector<std::uint64_t> rest_;
};

}  // namespace terrace::tri::tin::points
