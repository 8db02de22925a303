// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/stream/store.hpp>

#include "surface/store_window.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Parts a store's area into windows of about `points` points of a level and above: boxes, halved
/// across until they hold so few. They depend on the points alone. The windows of a box that was
/// halved have consecutive numbers, so a box may stand for them where more points are to be taken
/// at once.
///
/// Counts the points of a coarser level, as fine as 2^18 of them allow, and takes each for as many
/// as come on one. O(n log n) of those; they are read once.
class WindowTree {
 public:
  /// A window, or a box that was halved into windows.
  struct Part {
    StoredBox box{};                 ///< stored coordinates, closed
    double points = 0;               ///< about so many
    std::size_t first = 0, end = 0;  ///< the windows in it
    /// Parts by their number, both 0 for a window.
    std::uint32_t below = 0, above = 0;
    std::uint32_t axis = 0;  ///< across which it is halved
    double middle = 0;       ///< where

    [[nodiscard]] bool is_window() const { return below == 0; }
  };

  /// Throws: stream::Error on a damaged store, stream::Stopped.
  WindowTree(const stream::Store& store, unsigned level, std::size_t points);

  [[nodiscard]] std::size_t size() const { return windows_.size(); }
  /// Stored coordinates, closed; together they are the store's bounds.
  [[nodiscard]] const StoredBox& box(std::size_t window) const {
    return parts_[windows_[window]].box;
  }
  /// A window that holds the place; of a place outside one that is not far.
  [[nodiscard]] std::size_t window_of(const Point2& place) const;

  /// Number 0 is all of the store.
  [[nodiscard]] const Part& part(std::uint32_t number) const { return parts_[number]; }
  /// The largest parts for which takes(part) is true, or that are windows, in order.
  template <class Takes, class Visit>
  void for_each_part(const Takes& takes, const Visit& visit, std::uint32_t from = 0) const {
    const Part& part = parts_[from];
    if (part.is_window() || takes(part)) return visit(part);
    for_each_part(takes, visit, part.below);
    for_each_part(takes, visit, part.above);
  }

 private:
  std::uint32_t split(const StoredBox& box, std::span<Point2> sample, double each, std::size_t most,
                      unsigned depth);

  std::vector<Part> parts_;
  std::vector<std::uint32_t> windows_;  ///< their parts
};

}  // namespace terrace::terrain
