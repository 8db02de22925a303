// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "scaling.hpp"
#include "terrace/cluster/point.hpp"

namespace terrace::cluster {

/// A grow-only array, aligned for vectors, whose capacity is a multiple of sixteen. It manages
/// storage only, and its owner tracks the number of elements. Defined for float and std::uint32_t.
template <class T>
class Column {
 public:
  Column() = default;
  Column(const Column&) = delete;
  Column& operator=(const Column&) = delete;
  ~Column();
  /// Makes room for `count` elements and preserves the first `preserved`.
  void reserve(std::size_t count, std::size_t preserved = 0);
  [[nodiscard]] std::size_t capacity() const { return capacity_; }
  void swap(Column& other) noexcept;
  // Always inlined. tests/check_symbols.sh says why.
  [[gnu::always_inline]] operator T*() { return data_; }
  [[gnu::always_inline]] operator const T*() const { return data_; }

 private:
  T* data_ = nullptr;
  std::size_t capacity_ = 0;
};

/// Floats are processed sixteen at a time.
inline constexpr std::uint32_t kLanes = 16;
[[gnu::always_inline]] inline constexpr std::uint32_t round_to_lanes(std::uint32_t n) {
  return (n + kLanes - 1) & ~(kLanes - 1);
}

/// A coordinate beyond all points. Its square is finite.
inline constexpr float kFarAway = 1e18f;

/// A block during clustering, in the unit of its bounding box, in single precision.
///
/// The points are ordered along a space-filling curve, so that sixteen neighbours in memory (a
/// *group*) are neighbours in space. Each facility owns a *segment* of the pool with a copy of its
/// clients, so that gains are computed over contiguous memory. Segments begin and end at multiples
/// of sixteen. Surplus lanes have weight 0 and distance 0, so they never count.
struct BlockState {
  // Points, in curve order. Surplus lanes repeat the last point with weight 0.
  std::uint32_t count = 0;
  float facility_cost = 0;
  Column<float> x, y, z, w;
  Column<std::uint32_t> original;  ///< number of the point in the block
  Column<std::uint32_t> nearest;   ///< facility of the last assignment
  Column<float> distance;          ///< distance to that facility, squared at first

  // Groups: a ball around sixteen points of the curve.
  std::uint32_t group_count = 0;
  Column<float> group_x, group_y, group_z, group_radius;

  // Facilities. Surplus lanes are far away.
  std::uint32_t facility_count = 0;
  Column<std::uint32_t> facility;        ///< the point, by its position on the curve
  Column<float> fx, fy, fz;              ///< its position
  Column<float> gain_range;              ///< squared; candidates farther away gain nothing here
  Column<float> longest;                 ///< longest connection
  Column<float> weight_sum;              ///< sum of w over the clients
  Column<float> connection_cost;         ///< sum of w d over the clients
  Column<float> mean_x, mean_y, mean_z;  ///< centre of mass of the clients
  Column<std::uint32_t> begin, size;     ///< the segment

  // Pool of segments.
  std::uint32_t pool_used = 0;
  Column<float> px, py, pz, pw, pd;
  Column<float> pp;  ///< the client's position on the curve, as a float (exact below 2^24)

  // Facilities near the current candidate.
  std::uint32_t nearby_count = 0;
  Column<std::uint32_t> nearby;
  Column<std::uint32_t> close_flag;  ///< 1 if the candidate would close the facility
  Column<std::uint32_t> cursor;      ///< while segments are built: where the next client goes
  Column<float> scratch;
  Column<float> scratch_pool;

  /// The stop check of the options; never null.
  const base::StopCheck* check_stop = nullptr;
  std::uint32_t vectors_since_check = 0;
  /// Counts vectors of work and calls the stop check once per kVectorsBetweenChecks of them. Throws
  /// whatever the check throws.
  [[gnu::always_inline]] void tick(std::uint32_t vectors) {
    vectors_since_check += vectors;
    if (vectors_since_check >= kVectorsBetweenChecks) check_now();
  }

  /// Makes room for `facilities` facilities.
  void reserve_facilities(std::uint32_t facilities);
  /// Makes room for `extra` floats at the end of the pool. May move all segments.
  void reserve_pool(std::uint32_t extra);
  /// Appends a facility without clients at a point of the curve. Returns its number.
  std::uint32_t add_facility(std::uint32_t point);
  /// Removes facility j. The last facility takes its number.
  void remove_facility(std::uint32_t j);
  /// Makes room for a segment of `size` clients per facility, followed by sixteen lanes. Drops
  /// facilities without clients. Sets `cursor` to the beginnings of the segments, by the old
  /// facility numbers.
  void place_segments();
  /// Sorts the facilities in the order of the curve.
  void sort_facilities();

 private:
  static constexpr std::uint32_t kVectorsBetweenChecks = 1u << 16;
  void check_now();

  Column<float> spare_[6];
};

/// Sorts the points of a block along a space-filling curve and converts them to single precision.
class CurveSorter {
 public:
  /// Fills in the points of `state`, with weights divided by their mean, and makes room for the
  /// groups.
  void load(std::span<const Point3> points, std::span<const double> weights, double mean_weight,
            const Scaling& scaling, BlockState& state);

 private:
  /// A point in single precision: sixteen bytes that move at once.
  struct alignas(16) FloatPoint {
    float x, y, z;
    std::uint32_t original;  ///< number of the point in the block
  };

  std::vector<FloatPoint> unsorted_, sorted_;
  Column<std::uint32_t> key_, high_digit_, order_;
};

}  // namespace terrace::cluster
