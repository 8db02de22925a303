// SPDX-License-Identifier: Apache-2.0
#include "format/las/lattice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace terrace::stream {
namespace {

constexpr int kMostDecimals = 9;
constexpr std::array<double, kMostDecimals + 1> kPowers{1e0, 1e1, 1e2, 1e3, 1e4,
                                                        1e5, 1e6, 1e7, 1e8, 1e9};
/// One step less than the range of 32 bits, so that rounding stays within it.
constexpr double kReach = std::numeric_limits<std::int32_t>::max() - 1.0;

/// The fewest decimals, at least `decimals`, that reproduce every coordinate of the axis.
int decimals_of(std::span<const Point3> points, std::size_t axis, int decimals) {
  for (const Point3& p : points) {
    while (decimals < kMostDecimals &&
           std::nearbyint(p[axis] * kPowers[static_cast<std::size_t>(decimals)]) /
                   kPowers[static_cast<std::size_t>(decimals)] !=
               p[axis]) {
      ++decimals;
    }
  }
  return decimals;
}

}  // namespace

Lattice decimal_lattice(std::span<const Point3> points, const std::optional<Box3>& bounds,
                        bool degrees) {
  Box3 box;
  for (const Point3& p : points) box.include(p);
  if (bounds) box.include(*bounds);
  Lattice lattice;
  if (box.empty()) return lattice;
  std::array<double, 3> half{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lattice.offset[axis] = std::nearbyint(0.5 * box.min[axis] + 0.5 * box.max[axis]);
    half[axis] = 0.5 * box.max[axis] - 0.5 * box.min[axis];
  }
  half[0] = half[1] = std::max(half[0], half[1]);
  const int planar = decimals_of(points, 1, decimals_of(points, 0, 0));
  const std::array<int, 3> wanted{planar, planar, decimals_of(points, 2, 0)};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int usual = degrees && axis < 2 ? 7 : 3;
    int decimals = std::max(wanted[axis], usual);
    const auto reach = [&] {  // measured from the offset, which is rounded to a whole number
      return half[axis] * (bounds ? 1 : decimals > usual ? 1000 : 20) + 1;
    };
    while (decimals > 0 && reach() * kPowers[static_cast<std::size_t>(decimals)] > kReach) {
      --decimals;
    }
    double step = 1 / kPowers[static_cast<std::size_t>(decimals)];
    while (reach() / step > kReach) step *= 10;
    lattice.scale[axis] = step;
  }
  return lattice;
}

}  // namespace terrace::stream
