// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh.hpp"
#include "tin/star.hpp"

namespace terrace::tri::tin::points {

/// The samples in the star of a vertex, measured against triangles of the star's ring. Places are
/// relative to the vertex.
class StarSamples {
 public:
  /// `extra`: an additional sample, or kNone.
  void gather(const Mesh& mesh, const Star& star, const Vertex& centre, std::uint32_t extra);

  /// The largest error of the samples in the triangle of corners i < m < j of the ring, or infinity
  /// if one is above `limit` or doubles cannot resolve the triangle's plane.
  double worst(std::size_t i, std::size_t m, std::size_t j, double limit);
  /// Whether the tangent of the triangle's smallest angle is at least this.
  [[nodiscard]] bool wide(std::size_t i, std::size_t m, std::size_t j, double tangent) const;

  /// Lists the samples in the triangles of `fill`, which replaced the star.
  void list(Mesh& mesh, const Star& star, const PolygonFill& fill);

 private:
  using Words = std::vector<std::uint64_t>;
  /// Which samples lie left of the line from corner i to j, and which right; both: on it.
  struct Sides {
    bool known = false;
    Words left;
    Words right;
  };
  const Sides& sides(std::size_t i, std::size_t j);
  [[nodiscard]] double cross_at(std::size_t i, std::size_t j, std::size_t sample) const;
  void list_rest(Mesh& mesh, const Star& star, const PolygonFill& fill, std::size_t sample) const;

  std::vector<Vertex> ring_;  ///< relative to the centre, heights too
  std::vector<double> x_, y_, z_;
  std::vector<std::uint32_t> index_;
  std::array<std::array<Sides, kMaxRing>, kMaxRing> sides_;
  Words rest_;
};

}  // namespace terrace::tri::tin::points
