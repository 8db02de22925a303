// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>

#include "surface/box_tree.hpp"
#include "surface/store_window.hpp"
#include "surface/surface_corner.hpp"
#include "surface/window_tree.hpp"

namespace terrace::terrain {

class PointWindow;

/// The border of the voids of a cloud: the points of which not all triangles have circumcircles
/// within a reach, which is some spacings of the points around. All points with a long or open
/// triangle are among them, so with them a window is complete at once: a triangle that meets a box
/// either has a corner that is no border point, and lies within reach of the box, or it is one of
/// the triangulation of the border points alone. The same holds for circles that hold a place.
///
/// They are found in one pass over the store, as much work as triangulating it once, when windows
/// have looked for missing points so long that it pays: at most once, and as a rule never. What
/// windows contain does not depend on it.
///
/// Windows and places (PointSurface) of several threads share one; the threads that need the border
/// find it together.
class PointVoids {
 public:
  /// The store must outlive this.
  PointVoids(const stream::Store& store, unsigned level);
  PointVoids(const PointVoids&) = delete;
  PointVoids& operator=(const PointVoids&) = delete;

  /// Counts boxes that were looked at for missing points. True: it is better to find() the border.
  bool count_looks(std::uint64_t boxes);
  [[nodiscard]] std::uint64_t looks() const { return looks_; }

  /// Finds the border, unless it is known; the window is used for it. False: it is too long for a
  /// quarter of the window's memory, or all points are on one line. Throws: stream::Error,
  /// stream::Stopped.
  bool find(PointWindow& window);
  [[nodiscard]] bool known() const { return state_ == State::kKnown; }

  // Once it is known:
  /// How far around a box points may belong to triangles that meet it and have corners that are no
  /// border points.
  [[nodiscard]] double reach(const StoredBox& box) const;
  /// The corners, with heights in the store's vertical unit, of all triangles between border points
  /// that meet the box, each once.
  void for_each(const StoredBox& box, const std::function<void(const SurfaceCorner&)>& visit) const;
  /// At least the corners of all triangles between border points whose circumcircles hold a place,
  /// some of them more than once. The place must not be outside the hull.
  void for_each_around(const Point2& place, const std::function<void(const Point2&)>& visit) const;

 private:
  enum class State : std::uint8_t { kUnknown, kKnown, kNone };
  struct Part {
    std::vector<SurfaceCorner> border;
    double reach = 0;
  };
  void triangulate();

  const stream::Store& store_;
  unsigned level_;
  std::uint64_t most_looks_;
  std::atomic<std::uint64_t> looks_ = 0;
  std::atomic<State> state_ = State::kUnknown;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<WindowTree> tree_;
  std::vector<Part> parts_;  ///< of tree_
  std::size_t next_ = 0;     ///< of parts_, to be searched
  unsigned at_work_ = 0;     ///< threads
  std::size_t points_ = 0;   ///< of the border, so far

  tri::Delaunay2<double> border_;
  std::vector<double> heights_;  ///< by slot of vertex
  BoxTree triangles_;            ///< their slots
};

}  // namespace terrace::terrain
