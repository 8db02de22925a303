// SPDX-License-Identifier: GPL-3.0-or-later
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
/// across until they hold so few. They depend on the points alone.
///
/// Counts the points of a coarser level, as fine as 2^18 of them allow, and takes each for as many
/// as come on one. O(n log n) of those; they are read once.
class WindowTree {
 public:
  /// Throws: stream::Error on a damaged store, stream::Stopped.
  WindowTree(const stream::Store& store, unsigned level, std::size_t points);

  [[nodiscard]] std::size_t size() const { return boxes_.size(); }
  /// Stored coordinates, closed; together they are the store's bounds.
  [[nodiscard]] const StoredBox& box(std::size_t window) const { return boxes_[window]; }
  /// A window that holds the place; of a place outside one that is not far.
  [[nodiscard]] std::size_t window_of(const Point2& place) const;

 private:
  struct Node {
    double middle = 0;
    std::uint32_t axis = 0;
    std::uint32_t below = 0, above = 0;  ///< nodes, or windows with kWindow set
  };
  std::uint32_t split(const StoredBox& box, std::span<Point2> sample, std::size_t most,
                      unsigned depth);

  std::vector<Node> nodes_;
  std::vector<StoredBox> boxes_;
  std::uint32_t root_ = 0;
};

}  // namespace terrace::terrain
