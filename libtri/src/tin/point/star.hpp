// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh.hpp"
#include "tin/star.hpp"

namespace terrace::tri::tin::points {

/// The samples in the star of a vertex, measured against triangles of the star's ring. Positions
/// are relative to the vertex.
class StarSamples {
 public:
  /// `extra`: an additional sample, or kNone.
  void gather(const Mesh& mesh, const Star& star, const Vertex& centre, std::uint32_t extra);

  /// True if no triangle of corners of the ring comes within `bound` of a sample, so that no fill
  /// does. False if this is not known or there is no such sample.
  [[nodiscard]] bool out_of_reach(std::size_t sample, double bound) const;
  /// The sample from which the centre was made.
  [[nodiscard]] std::size_t own() const { return own_; }
  /// The sample that was last found beyond the limit.
  [[nodiscard]] std::size_t beyond() const { return beyond_; }

  /// The largest error of the samples in the triangle of corners i < m < j of the ring. Infinity if
  /// an error is above `limit` or doubles cannot resolve the triangle's plane.
  double worst(std::size_t i, std::size_t m, std::size_t j, double limit);
  /// True if the tangent of the triangle's smallest angle is at least this.
  [[nodiscard]] bool wide(std::size_t i, std::size_t m, std::size_t j, double tangent) const;

  /// Lists the samples in the triangles of `fill`, which replaced the star.
  void list(Mesh& mesh, const Star& star, const PolygonFill& fill);

 private:
  /// The samples left and right of the line from corner i to j, a bit for each sample; both bits
  /// are set on the line.
  struct Sides {
    const std::uint64_t* left;
    const std::uint64_t* right;
  };
  Sides sides(std::size_t i, std::size_t j);
  [[nodiscard]] double error_at(const Plane& plane, const Vertex& a, std::size_t sample) const;
  [[nodiscard]] double cross_at(std::size_t i, std::size_t j, std::size_t sample) const;
  void list_rest(Mesh& mesh, const Star& star, const PolygonFill& fill, std::size_t sample) const;

  std::vector<Vertex> ring_;  ///< relative to the centre, including heights
  std::vector<double> x_, y_, z_;
  std::vector<std::uint32_t> index_;
  std::size_t own_ = 0, beyond_ = 0;           ///< index_.size(): not found
  std::size_t words_ = 0;                      ///< number of words with a bit for each sample
  std::array<std::uint16_t, kMaxRing> known_;  ///< [i]: bit j if the sides of i and j are known
  std::vector<std::uint64_t> sides_;           ///< left and right of all pairs of corners
  std::vector<std::uint64_t> rest_;
};

}  // namespace terrace::tri::tin::points
