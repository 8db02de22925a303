// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <terrace/base/box.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>

/// Parts of a store at full resolution or at a level, for work done window by window.

namespace terrace::terrain {

/// A rectangle of a raster's lattice; may extend beyond the raster or be outside.
struct LatticeWindow {
  std::int64_t column = 0, row = 0;    ///< position of its first sample
  std::int64_t columns = 0, rows = 0;  ///< number of samples

  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
};

/// In stored coordinates.
using StoredBox = base::Box2;

/// Returns x and y.
inline base::Point2 flat(const stream::Point3& p) { return {p[0], p[1]}; }
/// Returns the x and y range of a box.
inline StoredBox flat(const stream::Box3& box) { return {flat(box.min), flat(box.max)}; }
/// Returns the box with all heights.
inline stream::Box3 tall(const StoredBox& box) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  return {{box.min[0], box.min[1], -kFar}, {box.max[0], box.max[1], kFar}};
}

/// Bounds on the heights of the points in a box, from the index alone.
struct ClusterHeights {
  double low = 0.0, high = 0.0;          ///< stored; over all clusters that meet the box
  std::vector<stream::Point3> examples;  ///< a few points in the box, if any were met
};
/// Returns nullopt if no cluster meets the box. Throws: stream::Error on a damaged store.
std::optional<ClusterHeights> cluster_heights(stream::StoreQuery& query, const StoredBox& box);

/// Points of a store, higher levels first, within a level by id. So the first of several points at
/// equal x and y represents them all.
struct WindowPoints {
  std::vector<stream::Point3> positions;  ///< stored coordinates
  std::vector<std::uint8_t> levels;       ///< the highest level of each point

  void clear() {
    positions.clear();
    levels.clear();
  }
};

/// Reads windows of one store: stream::StoreQuery for rectangles of x and y. One object per thread;
/// any number of them share a Store.
///
/// All functions throw stream::Error on a damaged store, and stream::Stopped if the store was asked
/// to stop.
class StoreWindow {
 public:
  /// cache_bytes: see stream::StoreQuery.
  explicit StoreWindow(const stream::Store& store, std::uint64_t cache_bytes = 0);

  /// Reads the heights of a raster's samples (Schema::grid) of `level` and above, by rows, in the
  /// store's vertical unit (scale and offset of the channel applied); NaN where there is no sample.
  /// At level 0, NaN means that the raster has no data there. Requires out.size() == window.size().
  void heights(const LatticeWindow& window, std::span<double> out, unsigned level = 0);
  /// The same in half the memory; requires float_is_exact().
  void heights(const LatticeWindow& window, std::span<float> out, unsigned level = 0);
  /// Whether floats can represent every height of the store exactly: the sample's type fits and it
  /// has neither scale nor offset.
  [[nodiscard]] bool float_is_exact() const;

  /// Replaces `out` by the points of `level` and above in the box.
  void points(const StoredBox& box, WindowPoints& out, unsigned level = 0);

  [[nodiscard]] stream::StoreQuery& query() { return query_; }

 private:
  template <class Height>
  void scatter(const LatticeWindow& window, std::span<Height> out, unsigned level);

  stream::StoreQuery query_;
};

}  // namespace terrace::terrain
