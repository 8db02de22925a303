// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "stand_in_hierarchy.hpp"
#include "store/write/raw_block.hpp"
#include "terrace/stream/store.hpp"

/// Realistic inputs for tests and benchmarks of the store.

namespace terrace::stream::testing {

/// Returns the blocks that a hierarchy would write, the root last, those of each level in order.
inline std::vector<store::RawBlock> recorded_hierarchy(
    const std::vector<std::vector<Point3>>& blocks, const StandInHierarchy::Options& options) {
  std::vector<store::RawBlock> recorded;
  StandInHierarchy hierarchy(0, options,
                             [&](const ClusteredBlock& b) { recorded.emplace_back(b); });
  for (const auto& block : blocks) hierarchy.push(block);
  hierarchy.finish();
  return recorded;
}

/// Returns a raster of side x side heights by midpoint displacement (diamond-square), rounded to
/// integers. The root mean square of the difference between neighbours is approximately `step`.
inline std::vector<double> fractal_heights(int side, double step, std::uint64_t seed) {
  int size = 1;
  while (size < side) size *= 2;
  const int stride = size + 1;
  std::vector<double> h(static_cast<std::size_t>(stride) * static_cast<std::size_t>(stride));
  std::mt19937_64 random(seed);
  const auto at = [&](int x, int y) -> double& {
    return h[static_cast<std::size_t>(y) * static_cast<std::size_t>(stride) +
             static_cast<std::size_t>(x)];
  };
  // The sum of four even numbers is close enough to normal. Fractal dimension 2.2.
  const auto noise = [&] {
    double sum = -2;
    for (int i = 0; i < 4; ++i) sum += static_cast<double>(random() >> 11) * 0x1p-53;
    return sum * 1.7320508075688772;
  };
  double amplitude = step * 0.34;
  for (int cell = 1; cell < size; cell *= 2) amplitude *= 1.7411011265922482;  // 2^0.8
  for (int cell = size; cell > 1; cell /= 2) {
    const int half = cell / 2;
    for (int y = half; y < stride; y += cell) {
      for (int x = half; x < stride; x += cell) {
        at(x, y) = (at(x - half, y - half) + at(x + half, y - half) + at(x - half, y + half) +
                    at(x + half, y + half)) /
                       4 +
                   amplitude * noise();
      }
    }
    for (int y = 0; y < stride; y += half) {
      for (int x = (y / half) % 2 == 0 ? half : 0; x < stride; x += cell) {
        double sum = 0;
        int n = 0;
        if (x >= half) sum += at(x - half, y), ++n;
        if (x + half < stride) sum += at(x + half, y), ++n;
        if (y >= half) sum += at(x, y - half), ++n;
        if (y + half < stride) sum += at(x, y + half), ++n;
        at(x, y) = sum / n + amplitude * noise() * 0.8408964152537145;
      }
    }
    amplitude /= 1.7411011265922482;
  }
  std::vector<double> result;
  result.reserve(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) result.push_back(std::nearbyint(at(x, y)));
  }
  return result;
}

/// Returns a tile of a raster as stored points: column, row, height.
inline std::vector<Point3> tile(const std::vector<double>& heights, int width, int height, int x0,
                                int y0, int side) {
  std::vector<Point3> points;
  for (int y = y0; y < std::min(height, y0 + side); ++y) {
    for (int x = x0; x < std::min(width, x0 + side); ++x) {
      points.push_back({static_cast<double>(x), static_cast<double>(y),
                        heights[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(x)]});
    }
  }
  return points;
}

/// Returns a patch of a rolling surface, sampled at random, in integer centimetres, as in a scan
/// that has lost its order.
inline std::vector<Point3> scan_patch(int number, std::size_t points) {
  std::mt19937_64 random(static_cast<std::uint64_t>(number) + 1);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<Point3> result;
  for (std::size_t i = 0; i < points; ++i) {
    const double x = 50 * (number % 16) + 50 * uniform(), y = 50 * (number / 16) + 50 * uniform();
    const double u = x / 40 - std::floor(x / 40), v = y / 25 - std::floor(y / 25);
    const double z = 300 + 30 * u * (1 - u) + 12 * v * (1 - v) + 0.2 * uniform();
    result.push_back({std::nearbyint((600000 + x) * 100) / 100,
                      std::nearbyint((5e6 + y) * 100) / 100, std::nearbyint(z * 100) / 100});
  }
  return result;
}

}  // namespace terrace::stream::testing
