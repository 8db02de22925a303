// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "point_fan.hpp"
#include "point_mesh.hpp"

namespace terrace::tri::tin {

/// Where a sample's vertex stands: rounded on a lattice, else as it is.
Vertex vertex_of(const Sample& sample, std::uint32_t index,
                 const std::optional<TinLattice>& lattice);

/// Triangles by the size of their error, 4 buckets per octave, the last one put in first: the exact
/// order is not needed. Entries are not removed when their triangle changes but recognised by its
/// present error.
class ErrorQueue {
 public:
  ErrorQueue() : buckets_(kBuckets) {}
  void push(const Pool<Triangle>& triangles, std::uint32_t triangle);
  /// kNone: empty.
  std::uint32_t pop(const Pool<Triangle>& triangles);

 private:
  static constexpr std::size_t kBuckets = 1024;
  std::vector<std::vector<std::uint32_t>> buckets_;
  std::size_t top_ = 0;  ///< no bucket above has entries
};

/// Greedy insertion into a Delaunay mesh.
class Greedy {
 public:
  Greedy(Mesh& mesh, double max_error, bool fixed_border, const std::optional<TinLattice>& lattice)
      : mesh_(mesh), bound_(max_error), fixed_border_(fixed_border), lattice_(lattice) {}

  /// Measures all lists anew, puts their triangles into the queue.
  void measure_all();
  /// Inserts samples until none that can become a vertex exceeds the bound, or there are
  /// max_vertices, or more than max_triangles.
  void run(std::size_t max_vertices, std::size_t max_triangles);

 private:
  /// False where the sample cannot become a vertex.
  bool insert(std::uint32_t index, std::uint32_t triangle);
  void collect_cavity(const Place2& p, const Spot& spot);
  void replace_cavity(std::uint32_t vertex);
  void rescan(std::uint32_t triangle);
  void enqueue(std::uint32_t triangle, double worst);

  struct Rim {
    std::uint32_t from;     ///< vertex
    std::uint32_t to;       ///< vertex
    std::uint32_t outside;  ///< triangle beyond
    unsigned back;          ///< which of its neighbours this is
  };

  Mesh& mesh_;
  double bound_;
  bool fixed_border_;
  std::optional<TinLattice> lattice_;
  ErrorQueue queue_;
  std::vector<std::uint32_t> cavity_;
  std::vector<Rim> rim_;
  std::vector<std::array<std::uint32_t, 2>> stack_;  ///< triangle beyond, from where
  std::vector<std::uint32_t> made_;
  Fan fan_;
};

}  // namespace terrace::tri::tin
