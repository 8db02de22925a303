// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "terrace/tri/delaunay2.hpp"

namespace terrace::tri {

/// A triangulation of those samples of a raster that a tolerance needs. Takes the place of a
/// triangulation in a multiresolution model and in a view control: the model adds and removes
/// samples by whole clusters, and this class decides which of them are vertices.
///
/// The raster is cut into *windows* of Windowed::kCells columns and rows, which share their sides.
/// A window whose samples have all been added can be *thinned*: its vertices are then those that
/// select_samples() chooses for the window's tolerance. The result keeps these promises:
///
/// - The triangles in a thinned window are within its tolerance of every sample in it, whatever the
///   other windows show: a side that two thinned windows share has the vertices that the finer of
///   the two needs, and the triangulation is constrained to the sides (Windowed).
/// - Where samples are missing there are no triangles.
/// - In other windows the vertices are the samples of level 1 and above.
/// - The triangles are a function of the samples and the tolerances alone.
///
/// Tolerances come in steps of 2^(1 / 16), about 4 %, so that windows change one at a time.
///
/// Points are columns and rows, at most 2^30 - 1. Handles of vertices are those of samples and stay
/// valid until the sample is removed. Memory: 60 bytes per vertex, 30 per sample, and 66 KB per
/// window with samples.
class ThinnedDelaunay2 {
 public:
  using Mesh = Delaunay2<std::int32_t, Windowed>;
  using Point = Mesh::Point;
  using Insertion = Mesh::Insertion;
  using Changes = Mesh::Changes;

  /// A step of tolerance. Step s stands for a tolerance of 2^(s / 16), in the unit of the heights.
  using Step = std::int16_t;
  /// Every sample is a vertex.
  static constexpr Step kEverySample = -2048;
  /// The four corners are enough wherever no data is missing.
  static constexpr Step kFewest = 2000;
  static constexpr int kStepsPerDoubling = 16;
  [[nodiscard]] static double tolerance_of(Step step);
  /// The coarsest step whose tolerance is not more than this. 0 gives kEverySample.
  [[nodiscard]] static Step step_of(double tolerance);

  struct Window {
    Point low{}, high{};                                      ///< first and last column and row
    double lowest = std::numeric_limits<double>::infinity();  ///< range of heights until now
    double highest = -std::numeric_limits<double>::infinity();
    bool complete = false;  ///< all samples in it have been added
    bool thinned = false;
    Step step = 0;  ///< if thinned
  };
  struct Target {
    std::uint32_t window = 0;
    Step step = 0;
  };

  /// last: the last column and row of the raster.
  explicit ThinnedDelaunay2(const Point& last);
  ~ThinnedDelaunay2();
  /// A moved-from object can only be destroyed or assigned to.
  ThinnedDelaunay2(ThinnedDelaunay2&&) noexcept;
  ThinnedDelaunay2& operator=(ThinnedDelaunay2&&) noexcept;

  // ---- Samples --------------------------------------------------------------------------------
  // The vertices follow at the next call of thin() or take_changes().

  /// Adds samples. Equal points share a handle. Throws std::invalid_argument if a point is not in
  /// the raster. assign() must follow for each that was created.
  std::vector<VertexId> build(std::span<const Point> points);
  void insert(std::span<const Point> points, std::span<Insertion> results,
              VertexId hint = kNoVertex);
  /// Sets or changes the height of a sample and its level in the hierarchy.
  void assign(VertexId sample, double height, unsigned level);
  void remove(std::span<const VertexId> samples);
  void reserve(std::size_t samples);

  // ---- Windows --------------------------------------------------------------------------------

  /// Upper bound of the numbers of windows.
  [[nodiscard]] std::uint32_t window_slots() const;
  /// A window, or null if this number has none: no samples, or only those of one side.
  [[nodiscard]] const Window* window(std::uint32_t number) const;
  /// States that all samples of a window have been added, so that other nodes have no data. (A
  /// window with a sample at each node is complete by itself.) Until a sample is removed from it.
  void set_complete(std::uint32_t window);
  /// Thins complete windows, each named once, to their steps. Returns the number of windows whose
  /// vertices were chosen again, neighbours included. About a microsecond per vertex chosen, twice
  /// as many vertices being tried.
  std::size_t thin(std::span<const Target> targets);
  /// True if the triangle is in a window that is thinned, but not to every sample, so that it
  /// contains no node without data.
  [[nodiscard]] bool is_in_thinned_window(TriangleId triangle) const;
  /// True if a sample that is not a vertex is at most one column and one row from this position.
  [[nodiscard]] bool has_hidden_sample_near(double column, double row) const;

  // ---- Reading --------------------------------------------------------------------------------
  // As in Delaunay2, for the vertices and the triangles between samples.

  [[nodiscard]] std::size_t sample_count() const;
  [[nodiscard]] std::size_t vertex_count() const;
  [[nodiscard]] std::size_t triangle_count() const;
  [[nodiscard]] Point point(VertexId sample) const;
  [[nodiscard]] std::array<VertexId, 3> vertices(TriangleId triangle) const;
  [[nodiscard]] std::array<TriangleId, 3> neighbours(TriangleId triangle) const;
  [[nodiscard]] TriangleId triangle_at(VertexId vertex) const;
  void adjacent(VertexId vertex, std::vector<VertexId>& result) const;
  /// The triangles at a vertex. They need not be connected, because others may lack data.
  void triangles_around(VertexId vertex, std::vector<TriangleId>& result) const;
  /// A number less than dense_slots(), which a vertex has alone for as long as it is one. For
  /// arrays with an entry per vertex: those by slot have an entry per sample.
  [[nodiscard]] std::uint32_t dense_slot(VertexId vertex) const;
  [[nodiscard]] std::uint32_t dense_slots() const;
  [[nodiscard]] std::uint32_t vertex_slots() const;
  [[nodiscard]] std::uint32_t triangle_slots() const;
  [[nodiscard]] bool alive(VertexId vertex) const;
  [[nodiscard]] bool alive(TriangleId triangle) const;
  [[nodiscard]] AliveRange<ThinnedDelaunay2, VertexId> all_vertices() const {
    return {*this, vertex_slots()};
  }
  [[nodiscard]] AliveRange<ThinnedDelaunay2, TriangleId> all_triangles() const {
    return {*this, triangle_slots()};
  }
  [[nodiscard]] std::uint64_t hash() const;
  [[nodiscard]] std::size_t memory_bytes() const;

  void start_journal();
  void take_changes(Changes& changes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::tri
