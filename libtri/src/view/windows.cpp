// SPDX-License-Identifier: Apache-2.0
#include "windows.hpp"

#include <algorithm>
#include <cmath>

namespace terrace::tri {
namespace {

constexpr double kWindowCells = Windowed::kCells;
/// Positions of samples are rounded when boxes are mapped to the ground and back.
constexpr double kRounding = 1e-3;
/// Boxes that meet more windows are not aligned. Only clusters of high levels are so large, and
/// their ranges of heights exceed those of their windows.
constexpr std::int64_t kMaxWindows = 4096;

/// The nearest column or row that a raster may have, 0 for NaN.
double within(double cell) { return std::fmin(std::fmax(cell, 0.0), 0x1p30); }

std::uint64_t key_of(std::int64_t x, std::int64_t y) {
  return static_cast<std::uint64_t>(y) << 32 | static_cast<std::uint64_t>(x);
}

}  // namespace

// A sample on a side is in both windows.
ViewWindows::Range ViewWindows::range_of(const Box3& ground) const {
  const Box3 cells = frame_.cells(ground);
  Range range;
  for (std::size_t k = 0; k < 2; ++k) {
    const double low = within(std::ceil(cells.min[k] - kRounding));
    const double high = within(std::floor(cells.max[k] + kRounding));
    range.first[k] =
        std::max<std::int64_t>(0, static_cast<std::int64_t>(std::ceil(low / kWindowCells)) - 1);
    range.last[k] = static_cast<std::int64_t>(high / kWindowCells);
  }
  return range;
}

bool ViewWindows::add(const ClusterRecord& record) {
  const Range range = range_of(record.box);
  bool grown = false;
  for (std::int64_t y = range.first[1]; y <= range.last[1]; ++y) {
    for (std::int64_t x = range.first[0]; x <= range.last[0]; ++x) {
      const double low = record.box.min[2], high = record.box.max[2];
      const auto [entry, is_new] = known_.try_emplace(key_of(x, y), Known{record.error, low, high});
      Known& known = entry->second;
      grown = grown || is_new || record.error > known.error || low < known.low || high > known.high;
      known.error = std::max(known.error, record.error);
      known.low = std::min(known.low, low);
      known.high = std::max(known.high, high);
    }
  }
  return grown;
}

ClusterRecord ViewWindows::aligned(const ClusterRecord& record, unsigned level) const {
  ClusterRecord result = record;
  if (record.box.empty()) return result;
  const Range range = range_of(record.box);
  if ((range.last[0] - range.first[0] + 1) * (range.last[1] - range.first[1] + 1) > kMaxWindows)
    return result;
  // While the record is not read the heights are unknown, and the error stays infinite.
  if (level == 0 && record.members != ClusterRecord::kUnread) result.error = 0.0;
  for (std::int64_t y = range.first[1]; y <= range.last[1]; ++y) {
    for (std::int64_t x = range.first[0]; x <= range.last[0]; ++x) {
      const auto found = known_.find(key_of(x, y));
      if (found == known_.end()) continue;
      const Known& known = found->second;
      result.error = std::max(result.error, known.error);
      const auto cx = static_cast<double>(x) * kWindowCells,
                 cy = static_cast<double>(y) * kWindowCells;
      Box3 box = frame_(Box3{{cx, cy, 0.0}, {cx + kWindowCells, cy + kWindowCells, 0.0}});
      box.min[2] = known.low;
      box.max[2] = known.high;
      result.box.include(box);
    }
  }
  return result;
}

bool ViewWindows::meets(const Box3& ground, const ThinnedDelaunay2::Window& window) const {
  const Box3 cells = frame_.cells(ground);
  for (std::size_t k = 0; k < 2; ++k) {
    if (cells.min[k] - kRounding > window.high[k] || cells.max[k] + kRounding < window.low[k])
      return false;
  }
  return true;
}

Box3 ViewWindows::box_of(const ThinnedDelaunay2::Window& window) const {
  const auto corner = [](const ThinnedDelaunay2::Point& p, double z) {
    return Point3{static_cast<double>(p[0]), static_cast<double>(p[1]), z};
  };
  Box3 box = frame_(Box3{corner(window.low, window.lowest), corner(window.high, window.highest)});
  const auto found =
      known_.find(key_of(window.low[0] / Windowed::kCells, window.low[1] / Windowed::kCells));
  if (found != known_.end()) {
    box.min[2] = found->second.low;
    box.max[2] = found->second.high;
  }
  return box;
}

}  // namespace terrace::tri
