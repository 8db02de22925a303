// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <terrace/base/simd.hpp>

#include "places.hpp"
#include "terrace/tri/point_tin.hpp"
#include "tin/ground.hpp"
#include "tin/mesh.hpp"
#include "tin/scan.hpp"

namespace terrace::tri::tin::rows {

/// Samples in rows and columns at given places, for a LatticeSurface.
class PlacedSamples {
 public:
  struct Vertex {
    std::int32_t x, y;
    double z;
    std::uint32_t sample;  ///< place_at() of the sample; kNone for a vertex of the frame
  };
  using Sample = RowCorner;
  static constexpr bool kBeside = true;
  static constexpr bool kThinDelaunay = true;

  PlacedSamples(PaddedSamples padded, const PointTinOptions& options, base::SimdPath set);

  std::int32_t columns() const { return samples_.columns; }
  std::int32_t rows() const { return samples_.rows; }
  const Ground& ground() const { return ground_; }
  float least_error() const;

  void judge(Triangle& triangle, const Vertex& a, const Vertex& b, const Vertex& c) const;
  bool open(std::uint32_t place) const;
  Vertex take(std::uint32_t place) const;
  void give_up(std::uint32_t place);
  void restore();
  std::uint32_t place_of(const Vertex& vertex) const {
    return vertex.sample == kNone ? 0 : vertex.sample;
  }
  Sample sample_of(const Vertex& vertex) const { return sample(place_of(vertex)); }
  bool within(const Vertex& a, const Vertex& b, const Vertex& c) const;
  bool fits(const Vertex& a, const Vertex& b, const Vertex& c, const Sample& removed) const;
  void narrow(const Vertex& v, const Vertex& b, const Vertex& c, Interval& rises) const;
  bool raise(Vertex& v, const Interval& rises) const;
  bool covers(const Vertex&, const Vertex&, const Vertex&) const { return true; }
  void publish(const Vertex& vertex, PointTin& tin) const;

  /// Measures every sample in the triangles and sets errors and stuck.
  void measure(const std::vector<Vertex>& vertices, const Triangles& triangles,
               PointTin& tin) const;

 private:
  std::size_t at(std::uint32_t place) const {
    return (place >> 16) * samples_.stride + (place & 0xFFFF);
  }
  Sample sample(std::uint32_t place) const;

  double bound_;
  TinLattice lattice_;
  Ground ground_;
  PaddedSamples padded_;
  RowSamples samples_;
  const RowScan& scan_;
  std::vector<std::pair<std::size_t, double>> given_up_;  ///< with their heights
};

}  // namespace terrace::tri::tin::rows
