// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "tin/ground.hpp"
#include "tin/mesh.hpp"
#include "tin/scan.hpp"

/// Handles missing data in a window. The whole window is triangulated, including samples without
/// data, until no triangle is mixed; then triangles that have a corner without data are dropped. A
/// triangle is mixed if
/// - its corners have data, but not all samples in it do, or
/// - a corner has no data, but the triangle contains (perhaps as a corner) an *inner* sample: one
///   with data whose 8 neighbours have data too.
/// Each inner sample is therefore only in triangles with data. The boundary may run through the
/// other samples with data, the *shore*.

namespace terrace::tri::tin {

class GridGaps {
 public:
  /// A NaN height marks missing data.
  template <class T>
  GridGaps(const GridSamples<T>& samples, std::int32_t columns, std::int32_t rows);

  /// Marks a sample as a vertex; samples are identified by place_at().
  void take(std::uint32_t place) { flags_[index(place)] |= kVertex; }
  bool taken(std::uint32_t place) const { return (flags_[index(place)] & kVertex) != 0; }

  /// True if the triangle, which has at least one corner without data, is mixed.
  template <class T>
  bool mixed(const GridCorner<T>& a, const GridCorner<T>& b, const GridCorner<T>& c) const;

  /// The sample whose insertion resolves a mixed triangle: the one deepest inside it, preferably on
  /// the shore or next to it. kNone if the samples' range has none.
  template <class T>
  std::uint32_t cure(const GridSamples<T>& samples, const Ground& ground, const GridCorner<T>& a,
                     const GridCorner<T>& b, const GridCorner<T>& c) const;

 private:
  static constexpr std::uint8_t kMissing = 1, kInner = 2, kVertex = 4, kCoastal = 8;
  std::size_t index(std::int32_t x, std::int32_t y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(x);
  }
  std::size_t index(std::uint32_t place) const { return index(column_of(place), row_of(place)); }
  template <class T>
  std::uint32_t next_to_inner(const GridSamples<T>& samples, const Ground& ground,
                              const GridCorner<T>* const (&corners)[3]) const;

  std::int32_t columns_;
  std::vector<std::uint8_t> flags_;
  std::vector<std::uint16_t> inner_before_;  ///< inner samples to the left, columns + 1 per row
};

}  // namespace terrace::tri::tin
