// SPDX-License-Identifier: GPL-3.0-or-later
#include "synth/fractal.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace terrace::tools {
namespace {

std::vector<float> field(const Fractal& fractal, std::uint32_t width, std::uint32_t height) {
  std::vector<float> heights;
  Fractal::Rows rows(fractal, 0, width);
  for (std::uint32_t y = 0; y < height; ++y) {
    const auto row = rows.row(y);
    heights.insert(heights.end(), row.begin(), row.end());
  }
  return heights;
}

double rms_step(const std::vector<float>& heights, std::size_t width, std::size_t lag = 1) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    if (i % width + lag < width) {
      const double d = heights[i + lag] - heights[i];
      sum += d * d;
      ++count;
    }
    if (i + lag * width < heights.size()) {
      const double d = heights[i + lag * width] - heights[i];
      sum += d * d;
      ++count;
    }
  }
  return std::sqrt(sum / static_cast<double>(count));
}

TEST(Fractal, StepEqualsRoughnessForAnyHurst) {
  for (const double hurst : {0.3, 0.5, 0.8, 0.95}) {
    for (const std::uint64_t seed : {1u, 2u}) {
      SCOPED_TRACE(hurst);
      const Fractal fractal({.seed = seed, .hurst = hurst, .rms_step = 2.65});
      EXPECT_NEAR(rms_step(field(fractal, 2048, 2048), 2048) / 2.65, 1.0, 0.03);
    }
  }
}

TEST(Fractal, StepIncludesRounding) {
  const Fractal fractal({.rms_step = 1.5, .rounded = true});
  std::vector<float> heights = field(fractal, 2048, 1024);
  for (float& h : heights) h = std::nearbyint(h);
  EXPECT_NEAR(rms_step(heights, 2048) / 1.5, 1.0, 0.03);
}

// The structure function of a field with exponent H grows like lag^H. Use lags well above the cell
// size and well below the longest wavelength.
TEST(Fractal, StructureFunctionFollowsTheHurstExponent) {
  for (const double hurst : {0.5, 0.8}) {
    const Fractal fractal({.seed = 5, .hurst = hurst});
    const std::vector<float> heights = field(fractal, 2048, 2048);
    const double slope = std::log2(rms_step(heights, 2048, 64) / rms_step(heights, 2048, 4)) / 4;
    EXPECT_NEAR(slope, hurst, 0.06);
  }
}

// The heights stay within five of the computed deviations, and these within the bound.
TEST(Fractal, StaysWithinItsBound) {
  const Fractal fractal({.seed = 3, .hurst = 0.5});
  const std::vector<float> heights = field(fractal, 4096, 512);
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  EXPECT_LT(std::max(-*low, *high), 5 * fractal.standard_deviation());
  EXPECT_LT(5 * fractal.standard_deviation(), fractal.bound());
}

TEST(Fractal, PiecesMatchTheFullField) {
  const Fractal fractal({.seed = 9});
  const std::uint32_t width = 301;
  const std::vector<float> full = field(fractal, width, 200);
  for (const std::uint32_t first : {0u, 1u, 2u, 77u, 300u}) {
    for (const std::uint32_t top : {0u, 1u, 63u, 199u}) {
      const std::uint32_t piece_width = std::min(width - first, 45u);
      Fractal::Rows rows(fractal, first, piece_width);
      for (std::uint32_t y = top; y < std::min(top + 9, 200u); ++y) {
        const auto row = rows.row(y);
        ASSERT_TRUE(std::equal(row.begin(), row.end(),
                               full.begin() + static_cast<std::ptrdiff_t>(y * width + first)))
            << first << ' ' << y;
      }
    }
  }
}

// The heights must have the same bytes on every machine and with every compiler. A change of the
// method changes them, and with them the input of every benchmark.
TEST(Fractal, BytesAreFixed) {
  const Fractal fractal({.seed = 1});
  std::uint64_t hash = 14695981039346656037u;  // FNV-1a
  for (const float h : field(fractal, 257, 129)) {
    hash = (hash ^ std::bit_cast<std::uint32_t>(h)) * 1099511628211u;
  }
  EXPECT_EQ(hash, 12470911040733538674u);
}

TEST(Fractal, SeedsDiffer) {
  const auto a = field(Fractal({.seed = 1}), 64, 64);
  const auto b = field(Fractal({.seed = 2}), 64, 64);
  EXPECT_NE(a, b);
}

}  // namespace
}  // namespace terrace::tools
