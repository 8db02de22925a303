// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "terrace/cluster/metric.hpp"

namespace terrace::cluster {

/// A channel as an axis, from 0 and scaled so that squares neither overflow nor underflow.
/// Differences in ground units are those of value(), times 2^exponent.
struct ChannelAxis {
  double least = 0.0;   ///< half of the least value
  double weight = 0.0;  ///< in [0.5, 1), or 0 if the channel does not count
  int shift = 0;        ///< scales half differences to below 1
  int exponent = std::numeric_limits<int>::min();
  double range = 0.0;  ///< largest value()

  /// Channel c of `count` points.
  ChannelAxis(const Channels& channels, std::size_t c, std::size_t count) {
    double min_half = 0.0, max_half = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const double half = 0.5 * channels.values[i * channels.size() + c];
      min_half = i == 0 ? half : std::min(min_half, half);
      max_half = i == 0 ? half : std::max(max_half, half);
    }
    least = min_half;
    int weight_exponent = 0;
    weight = std::frexp(channels.weights[c], &weight_exponent);
    if (weight == 0.0 || max_half == min_half) {
      weight = 0.0;
      return;
    }
    std::frexp(max_half - min_half, &shift);
    exponent = shift + 1 + weight_exponent;
    range = value(2.0 * max_half);
  }

  [[nodiscard]] double value(double original) const {
    return weight * std::ldexp(0.5 * original - least, -shift);
  }
};

}  // namespace terrace::cluster
