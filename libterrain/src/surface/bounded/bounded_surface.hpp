// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <terrace/stream/store.hpp>

#include "surface/corner.hpp"
#include "surface/store_window.hpp"
#include "terrace/terrain/context.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/region.hpp"

/// A surface of few triangles that is within a bound of every sample of a store, made window by
/// window on demand.

namespace terrace::terrain {

/// The triangles of one window. Stored coordinates, heights in the store's vertical unit.
class BoundedPart {
 public:
  using Triangle = std::array<std::uint32_t, 3>;

  BoundedPart() = default;
  /// Turns triangles counter-clockwise. last_window: per vertex, the last window that may have it.
  BoundedPart(std::vector<SurfaceCorner> vertices, std::vector<Triangle> triangles,
              std::vector<std::uint32_t> last_window);

  [[nodiscard]] std::span<const SurfaceCorner> vertices() const { return vertices_; }
  [[nodiscard]] std::span<const Triangle> triangles() const { return triangles_; }
  [[nodiscard]] std::uint32_t last_window(std::uint32_t vertex) const {
    return last_window_[vertex];
  }
  [[nodiscard]] SurfaceTriangle corners(const Triangle& t) const {
    return {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]};
  }
  /// Appends the triangles that contain a place, borders included.
  void append_at(const Point2& place, std::vector<SurfaceTriangle>& out) const;
  [[nodiscard]] std::size_t bytes() const;

 private:
  /// Returns the row or column of cells with a coordinate, clamped to the cells.
  [[nodiscard]] std::size_t cell(double coordinate, std::size_t axis) const;

  std::vector<SurfaceCorner> vertices_;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> last_window_;
  // The triangles that reach into each cell of a grid, by rows.
  StoredBox box_;
  std::size_t side_ = 0;  ///< cells along each axis
  std::vector<std::uint32_t> begin_, listed_;
};

/// A triangulated surface through some samples of a store. Its vertical distance from every sample
/// is at most the bound, apart from rounding. It depends only on the store and the bound: neither
/// on threads, memory, regions nor on which windows are made, in which order. Neighbouring windows
/// have the same vertices on the side between them. Thread-safe.
///
/// - In a raster, windows have about 512 columns and rows, as in `mesh` with a bound. Triangles
///   contain no missing sample, and samples with a missing neighbour may be on no triangle.
/// - Irregular points have windows of about 65,536 points, which cover their convex hull. Of
/// several
///   points at one place the first counts, as in the surface of all points.
class BoundedSurface {
 public:
  virtual ~BoundedSurface() = default;
  BoundedSurface(const BoundedSurface&) = delete;
  BoundedSurface& operator=(const BoundedSurface&) = delete;

  [[nodiscard]] virtual std::size_t size() const = 0;
  /// Returns the closed box of a window.
  [[nodiscard]] virtual StoredBox box(std::size_t window) const = 0;
  /// Appends the windows whose boxes contain a place, ascending.
  virtual void append_windows_at(const Point2& place, std::vector<std::uint32_t>& out) const = 0;
  /// Meshes a window, at a few microseconds per vertex and 0.1 microseconds per sample.
  /// Throws: stream::Error on a damaged store or too many points close together; stream::Stopped.
  [[nodiscard]] virtual BoundedPart mesh(std::size_t window) const = 0;

  /// Returns how many windows may be meshed at once within `memory_bytes`, at most `threads`.
  /// Throws: stream::Error if the memory does not suffice for one.
  [[nodiscard]] unsigned threads_within(std::uint64_t memory_bytes, unsigned threads) const;

 protected:
  /// bytes_per_window: peak memory of meshing one.
  BoundedSurface(const stream::Store& store, std::uint64_t bytes_per_window)
      : store_(store), bytes_per_window_(bytes_per_window) {}

  stream::Store store_;
  std::uint64_t bytes_per_window_;
};

/// Returns the surface for a bound in metres; heights in an unknown unit count as metres. Throws:
/// UsageError for a negative bound; stream::Error on a damaged store, stream::Stopped.
std::unique_ptr<BoundedSurface> bounded_surface(const stream::Store& store, double max_error);
/// The kinds of bounded_surface(). bound: in the store's vertical unit. The surface depends on the
/// size of windows.
std::unique_ptr<BoundedSurface> bounded_raster(const stream::Store& store, double bound,
                                               std::int64_t window_cells = 512);
std::unique_ptr<BoundedSurface> bounded_cloud(const stream::Store& store, double bound,
                                              std::size_t window_points = std::size_t{1} << 16);

/// Throws: UsageError if options choose another surface together with a bound.
void need_bound_alone(unsigned level, std::span<const FinerRegion> focuses,
                      const std::optional<double>& max_edge);

/// Keeps recently meshed windows of a surface. Thread-safe.
class BoundedParts {
 public:
  /// At most `max_bytes` and the windows in use are kept.
  BoundedParts(std::shared_ptr<const BoundedSurface> surface, std::size_t max_bytes)
      : surface_(std::move(surface)), max_bytes_(max_bytes) {}

  [[nodiscard]] const BoundedSurface& surface() const { return *surface_; }

  /// Returns a window, meshed now if necessary. Throws: as BoundedSurface::mesh().
  std::shared_ptr<const BoundedPart> operator()(std::uint32_t window);

 private:
  std::shared_ptr<const BoundedSurface> surface_;
  std::size_t max_bytes_;
  std::mutex mutex_;
  std::map<std::uint32_t, std::shared_ptr<const BoundedPart>> recent_, older_;
  std::size_t recent_bytes_ = 0;
};

}  // namespace terrace::terrain
