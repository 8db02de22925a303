// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/stream/store.hpp>

#include "region.hpp"
#include "store_window.hpp"

namespace terrace::tools {

/// The plane in boxes of about equally many points each, which depend on the points alone. Every
/// place is in one part; neighbours in number are near each other.
class PointParts {
 public:
  /// Of the points of `level` and above. A part has about points_per_part, estimated from the
  /// points of a coarser level where there are too many to look at; more only where they share a
  /// place. Reads at most 2^20 points. No points: one part. Throws: stream::Error on damage.
  PointParts(const stream::Store& store, unsigned level, std::uint64_t points_per_part);
  /// Of `sample`, each of which stands for `weight` points. The sample is reordered. Coordinates
  /// must be finite.
  PointParts(std::span<Point2> sample, double weight, std::uint64_t points_per_part);

  [[nodiscard]] std::size_t size() const { return boxes_.size(); }
  /// Closed; the outermost reach to infinity. A box has its lower sides, the next its upper ones.
  [[nodiscard]] const StoredBox& box(std::size_t part) const { return boxes_[part]; }
  [[nodiscard]] std::uint32_t part_of(const Point2& place) const;

 private:
  struct Node {
    double split = 0;
    std::uint32_t axis = 0;
    /// Of the two sides; a number beyond kLeaf is that of a part.
    std::array<std::uint32_t, 2> below{};
  };
  static constexpr std::uint32_t kLeaf = std::uint32_t{1} << 31;

  void divide(std::span<Point2> sample, std::size_t most);
  std::uint32_t divide(std::span<Point2> sample, const StoredBox& box, std::size_t most);

  std::vector<Node> nodes_;
  std::vector<StoredBox> boxes_;
  std::uint32_t root_ = 0;
};

}  // namespace terrace::tools
