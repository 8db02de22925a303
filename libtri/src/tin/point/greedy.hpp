// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "fan.hpp"
#include "mesh.hpp"
#include "tin/cavity.hpp"
#include "tin/error_queue.hpp"

namespace terrace::tri::tin::points {

/// The vertex of a sample: rounded on a lattice, otherwise at the sample.
Vertex vertex_of(const Sample& sample, std::uint32_t index,
                 const std::optional<TinLattice>& lattice);

/// Greedy insertion into a Delaunay mesh.
class Greedy {
 public:
  Greedy(Mesh& mesh, double max_error, bool fixed_border, const std::optional<TinLattice>& lattice)
      : mesh_(mesh), bound_(max_error), fixed_border_(fixed_border), lattice_(lattice) {}

  /// From now on a new vertex only splits the triangles that contain it, for meshes that are no
  /// longer Delaunay.
  void stop_delaunay() { delaunay_ = false; }
  /// Passes once over the samples 0, step, 2 * step, ... in their order. Each sample that is beyond
  /// the bound when its turn comes becomes a vertex, if it can. This is several times as fast as
  /// run() per vertex, as no lists are kept, and makes more vertices; removal leaves about as many.
  /// Later vertices may move the surface away from samples that were passed. The lists must be
  /// rebuilt afterwards.
  void sweep(std::uint32_t step);
  /// Starts with these triangles, which have an error, from newly made lists. Samples are handled
  /// in parts of `together` numbers, which are close to each other. Each part and its triangles
  /// stay in the cache, and the result is as good as if all parts were handled together.
  void start(std::span<const std::uint32_t> triangles, std::size_t together);
  /// Inserts samples until none that can become a vertex exceeds the bound, or there are
  /// max_vertices, or more than max_triangles.
  void run(std::size_t max_vertices, std::size_t max_triangles);

 private:
  /// Returns false if the sample cannot become a vertex.
  bool insert(std::uint32_t index, std::uint32_t triangle);
  /// The spot where a vertex can be inserted; it has no triangle if that is impossible.
  [[nodiscard]] Spot spot_for(const Vertex& vertex, std::uint32_t near) const;
  /// True if the spot is on the border.
  [[nodiscard]] bool is_open(const Spot& spot) const;
  /// Adds a vertex; the new triangles are the cavity's.
  void put(const Vertex& vertex, const Spot& spot);
  /// Distributes the samples of the first `old` of the cavity's triangles to the new ones.
  void deal_samples(const Vertex& vertex, std::size_t old, bool open, std::uint32_t apart);
  /// Moves a sample from one triangle's list to another's.
  void move(std::uint32_t index, std::uint32_t from, std::uint32_t to);
  void rescan(std::uint32_t triangle);
  void enqueue(std::uint32_t triangle, double worst);
  /// The next triangle, or kNone if there is none in any part.
  std::uint32_t next_triangle();

  Mesh& mesh_;
  double bound_;
  bool fixed_border_;
  bool delaunay_ = true;
  std::size_t together_ = 0;
  std::size_t part_ = 0;  ///< the current part
  /// The triangles with which later parts start, by part; some of them may have changed since.
  std::vector<std::vector<std::uint32_t>> later_;
  std::optional<TinLattice> lattice_;
  static constexpr float kLeastError = 1e-30F;
  ErrorBuckets queue_{kLeastError};
  Cavity cavity_;
  Fan fan_;
};

}  // namespace terrace::tri::tin::points
