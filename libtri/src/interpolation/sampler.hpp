// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "cavity.hpp"
#include "terrace/tri/interpolation.hpp"
#include "voronoi_cell.hpp"

namespace terrace::tri::planar {

/// Answers queries one after another. Each search starts where the last one ended. For use by one
/// thread. Memory is kept between queries.
template <class Kernel>
class Sampler {
 public:
  explicit Sampler(const Mesh<Kernel>& mesh);
  ~Sampler();
  Sampler(Sampler&&) = delete;
  Sampler& operator=(Sampler&&) = delete;

  /// Makes the next search start at this vertex. kNone means the vertex last used by the
  /// triangulation.
  void start_at(std::uint32_t vertex);
  /// See weights_at().
  std::span<const VertexWeight> compute_weights(const Query& p, Interpolation method);
  /// See gradients_at().
  Gradient gradient(const Query& p, const Heights& heights, GradientFrom from);

 private:
  struct Exact;

  void weigh_edge(const Query& p, std::uint32_t a, std::uint32_t b);
  void weigh_triangle(const Query& p, std::uint32_t t);
  void weigh_neighbours(const Query& p, std::uint32_t t);
  /// Measures the cell of p in cavity_. Returns false if double precision does not suffice.
  bool measure(const Query& p);
  /// Returns false if the numbers leave a weight undecided.
  template <class Number>
  bool compute_weights(const VoronoiCell<Number>& cell);
  void divide_by_sum();
  /// centre: the vertex at p, or kNoVertex.
  Gradient gradient_of_cell(const Query& p, const Heights& heights, VertexId centre);
  Gradient gradient_of_triangles(const Heights& heights);
  /// Stores the triangles that meet at p in triangles_.
  void find_triangles(const Query& p, const QueryPlace& place);
  Exact& exact();

  const Mesh<Kernel>& mesh_;
  std::uint32_t last_ = kNone;
  std::vector<VertexWeight> weights_;
  Cavity cavity_;
  VoronoiCell<double> cell_;
  std::vector<std::uint32_t> triangles_;
  std::vector<std::array<double, 2>> slopes_;  ///< slopes of weights, by corner of cavity_
  std::unique_ptr<Exact> exact_;               ///< created on first use
};

}  // namespace terrace::tri::planar
