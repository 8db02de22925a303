// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "terrace/cluster/point.hpp"

namespace terrace::cluster {

/// Maps a block to coordinates in [0, 1], so that squares neither overflow nor underflow, whatever
/// the block's offset and scale. Lengths are divided by a power of two, so only the difference to
/// the corner is rounded.
struct Scaling {
  Point3 corner{};      ///< least coordinates
  int exponent = 0;     ///< the longest side is in [2^(exponent-1), 2^exponent)
  Point3 extent{};      ///< sides of the bounding box, scaled
  double diagonal = 0;  ///< diagonal of the bounding box, scaled
  bool plain = true;    ///< factor is a normal number and the differences are finite
  double factor = 1.0;  ///< 2^-exponent, if plain

  explicit Scaling(std::span<const Point3> points);

  /// Returns coordinate `value` on the given axis, scaled.
  [[nodiscard]] double scaled(double value, unsigned axis) const {
    return plain ? (value - corner[axis]) * factor : scaled_slowly(value, axis);
  }
  [[nodiscard]] Point3 scaled(const Point3& p) const {
    return {scaled(p[0], 0), scaled(p[1], 1), scaled(p[2], 2)};
  }
  /// Returns a scaled length in the unit of the points; infinite if it overflows a double.
  [[nodiscard]] double unscaled(double length) const;

 private:
  [[nodiscard]] double scaled_slowly(double value, unsigned axis) const;
};

}  // namespace terrace::cluster
