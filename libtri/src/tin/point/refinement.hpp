// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh.hpp"
#include "pool.hpp"
#include "samples.hpp"
#include "terrace/tri/point_tin.hpp"
#include "tin/refinement.hpp"
#include "tin/star.hpp"

/// The parts of the refinement of scattered samples: the first mesh (start.cpp), the removal of
/// vertices (hole.cpp), and the lists of samples per triangle (lists.cpp).

namespace terrace::tri::tin::points {

struct SampleList {
  /// In the order of a curve, so that consecutive samples are close to each other. Every position
  /// occurs once, or with PointDuplicates::all twice if heights differ.
  Pool<Sample> all;
  std::size_t duplicates = 0;
  double duplicate_range = 0;  ///< the largest difference between heights at one position
};

/// Checks and sorts samples and merges duplicates. Throws as point_tin() does.
SampleList prepare_samples(std::span<const double> x, std::span<const double> y,
                           std::span<const double> z, PointDuplicates duplicates);

/// Makes the first mesh of the frame's vertices alone. Throws as point_tin() does if the frame is
/// not a convex polygon.
PointMesh start_with_frame(std::span<const Point3> frame);

/// Makes the first mesh of the corners of the samples' hull. Empty if all samples are collinear.
PointMesh start_with_hull(Pool<Sample>& samples);

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
  [[nodiscard]] bool has_wide_angles(std::size_t i, std::size_t m, std::size_t j) const;
  /// The samples left and right of the line from corner i to j, a bit for each sample. Both bits
  /// are set on the line.
  struct Sides {
    const std::uint64_t* left;
    const std::uint64_t* right;
  };
  Sides sides(std::size_t i, std::size_t j);
  [[nodiscard]] double error_at(const Plane& plane, const Vertex& a, std::size_t sample) const;
  [[nodiscard]] double cross_at(std::size_t i, std::size_t j, std::size_t sample) const;
  void list_unlisted(const Star& star, const PolygonFill& fill, std::size_t sample);

  PointSamples& all_;
  const PointMesh* mesh_ = nullptr;
  const Star* star_ = nullptr;
  std::vector<Vertex> ring_;  ///< relative to the centre, including heights
  std::vector<double> x_, y_, z_;
  std::vector<std::uint32_t> index_;
  /// The sample from which the centre was made, and the one that was last found beyond the limit.
  /// index_.size() means none.
  std::size_t own_sample_ = 0, failed_sample_ = 0;
  std::size_t words_ = 0;  ///< number of words with a bit for each sample
  std::array<std::uint16_t, kMaxRing>
      known_sides_;                   ///< [i]: bit j if the sides of i and j are known
  std::vector<std::uint64_t> sides_;  ///< left and right of all pairs of corners
  std::vector<std::uint64_t> unlisted_;
};

using PointRefinement = Refinement<PointSamples>;

struct Measured {
  TinErrors errors;            ///< covered: samples listed and vertices; uncovered: samples outside
  std::size_t above = 0;       ///< samples beyond the bound
  std::size_t insertable = 0;  ///< samples beyond the bound that may become vertices
  /// The triangles with samples to insert, neighbours close to each other.
  std::vector<std::uint32_t> triangles_to_refine;
};

/// Rebuilds all lists from the samples 0, step, 2 * step, ... that are not vertices, each in the
/// triangle that contains it (exact), and measures them. `place` and `error` of a triangle become
/// those of its worst sample that is beyond the bound and not stuck. `error` is 0 if there is none.
Measured list_samples(PointRefinement& refinement, std::uint32_t step);

/// Gives the same result for all samples from lists that are complete, several times as fast: each
/// sample is checked exactly against the triangle that lists it.
Measured measure_lists(PointRefinement& refinement);

/// Passes once over the samples 0, step, 2 * step, ... in their order. Each sample that is beyond
/// the bound when its turn comes becomes a vertex, if it can. This is several times as fast as
/// refine() per vertex, as no lists are kept, and makes more vertices. Removal leaves about as
/// many. Later vertices may move the surface away from samples that were passed. The lists must be
/// rebuilt afterwards.
void sweep(PointRefinement& refinement, std::uint32_t step);

}  // namespace terrace::tri::tin::points
