// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "terrace/cluster/point.hpp"

/// Point sets for tests and benchmarks.

namespace terrace::cluster::inputs {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Returns a number that is uniform in [0, 1).
inline double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// Returns an approximately normal number with mean 0 and variance 1, a sum of twelve uniform ones.
inline double bell(std::mt19937_64& random) {
  double sum = -6.0;
  for (int k = 0; k < 12; ++k) sum += uniform(random);
  return sum;
}

/// Returns points that are uniform in the unit cube.
inline std::vector<Point3> cube(std::size_t count, std::mt19937_64& random) {
  std::vector<Point3> points(count);
  for (Point3& p : points) p = {uniform(random), uniform(random), uniform(random)};
  return points;
}

/// Returns a bumpy closed surface scanned in parallel swaths from pole to pole, one after another.
/// Each is `width` points wide and long enough for about the same density along and across. There
/// are width * width * swaths * swaths / 2 points. Requires: width is even.
inline std::vector<Point3> scan(std::size_t swaths, std::size_t width, std::mt19937_64& random) {
  constexpr double kPi = 3.14159265358979323846;
  const std::size_t around = swaths * width;
  const std::size_t rows = around / 2;
  std::vector<Point3> points;
  points.reserve(around * rows);
  for (std::size_t swath = 0; swath < swaths; ++swath) {
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t k = 0; k < width; ++k) {
        const double u = static_cast<double>(swath * width + k) + 0.3 * uniform(random);
        const double v = static_cast<double>(row) + 0.3 * uniform(random);
        const double a = 2 * kPi * u / static_cast<double>(around);
        const double b = kPi * v / static_cast<double>(rows);
        const double r = 1.0 + 0.1 * std::sin(5 * a) * std::sin(4 * b) +
                         0.03 * std::sin(23 * a + 17 * b) + 0.0005 * bell(random);
        points.push_back(
            {r * std::sin(b) * std::cos(a), r * std::sin(b) * std::sin(a), r * std::cos(b)});
      }
    }
  }
  return points;
}

/// Returns a fractal height field of side x side cells (midpoint displacement on a square), with
/// heights scaled so that neighbours in a row differ by `step` (root mean square).
inline std::vector<double> fractal_heights(std::size_t side, double step, std::mt19937_64& random) {
  std::size_t size = 1;
  while (size < side) size *= 2;
  const std::size_t pitch = size + 1;
  std::vector<double> h(pitch * pitch, 0.0);
  for (const std::size_t corner : {std::size_t{0}, size, size * pitch, size * pitch + size}) {
    h[corner] = bell(random);
  }
  double amplitude = 1.0;
  for (std::size_t half = size / 2; half > 0; half /= 2) {
    for (std::size_t y = half; y < pitch; y += 2 * half) {
      for (std::size_t x = half; x < pitch; x += 2 * half) {
        h[y * pitch + x] =
            0.25 * (h[(y - half) * pitch + x - half] + h[(y - half) * pitch + x + half] +
                    h[(y + half) * pitch + x - half] + h[(y + half) * pitch + x + half]) +
            amplitude * bell(random);
      }
    }
    amplitude *= 0.70710678118654752;
    for (std::size_t y = 0; y < pitch; y += half) {
      for (std::size_t x = (y / half) % 2 == 0 ? half : 0; x < pitch; x += 2 * half) {
        double sum = 0.0;
        double n = 0.0;
        if (x >= half) sum += h[y * pitch + x - half], ++n;
        if (x + half < pitch) sum += h[y * pitch + x + half], ++n;
        if (y >= half) sum += h[(y - half) * pitch + x], ++n;
        if (y + half < pitch) sum += h[(y + half) * pitch + x], ++n;
        h[y * pitch + x] = sum / n + amplitude * bell(random);
      }
    }
    amplitude *= 0.70710678118654752;
  }
  double squares = 0.0;
  for (std::size_t y = 0; y < side; ++y) {
    for (std::size_t x = 1; x < side; ++x) {
      const double d = h[y * pitch + x] - h[y * pitch + x - 1];
      squares += d * d;
    }
  }
  const double scale = step / std::sqrt(squares / static_cast<double>(side * (side - 1)));
  std::vector<double> heights(side * side);
  for (std::size_t y = 0; y < side; ++y) {
    for (std::size_t x = 0; x < side; ++x) heights[y * side + x] = scale * h[y * pitch + x];
  }
  return heights;
}

/// Returns a fractal elevation model cut into square tiles, tile after tile. Heights are integer
/// metres.
/// Requires: tile divides side.
inline std::vector<Point3> dem_tiles(std::size_t side, std::size_t tile, double cell, double step,
                                     std::mt19937_64& random) {
  const std::vector<double> heights = fractal_heights(side, step, random);
  std::vector<Point3> points;
  points.reserve(side * side);
  for (std::size_t top = 0; top < side; top += tile) {
    for (std::size_t left = 0; left < side; left += tile) {
      for (std::size_t y = top; y < top + tile; ++y) {
        for (std::size_t x = left; x < left + tile; ++x) {
          points.push_back({static_cast<double>(x) * cell, static_cast<double>(y) * cell,
                            std::floor(heights[y * side + x] + 0.5)});
        }
      }
    }
  }
  return points;
}

inline void shuffle(std::vector<Point3>& points, std::mt19937_64& random) {
  for (std::size_t i = points.size(); i > 1; --i) {
    std::swap(points[i - 1], points[((random() >> 32) * i) >> 32]);
  }
}

}  // namespace terrace::cluster::inputs
