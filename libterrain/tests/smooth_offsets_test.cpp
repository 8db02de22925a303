// SPDX-License-Identifier: Apache-2.0
#include "earth/smooth_offsets.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/random.hpp>

#include "earth/quintic_surface.hpp"

namespace terrace::terrain {
namespace {

constexpr double kTolerance = 1e-5;

class SmoothOffsets : public ::testing::Test {
 protected:
  double random() {
    seed_ = base::splitmix64(seed_);
    return base::unit_interval(seed_);
  }
  std::vector<Point2> places(std::size_t count, const Point2& low, const Point2& size) {
    std::vector<Point2> places;
    for (std::size_t i = 0; i < count; ++i) {
      places.push_back({low[0] + size[0] * random(), low[1] + size[1] * random()});
    }
    return places;
  }
  /// Compares with the function itself. Returns the number of its evaluations.
  std::size_t check(const std::vector<Point2>& places,
                    const std::function<double(const Point2&)>& offset) {
    std::vector<double> heights;
    for (std::size_t i = 0; i < places.size(); ++i) {
      heights.push_back(random() < 0.1 ? std::numeric_limits<double>::quiet_NaN()
                                       : 9000 * random());
    }
    const std::vector<double> before = heights;
    std::size_t asked = 0;
    add_smooth_offsets(places, heights, kTolerance,
                       [&](std::span<const Point2> at, std::span<double> out) {
                         asked += at.size();
                         for (std::size_t i = 0; i < at.size(); ++i) out[i] += offset(at[i]);
                       });
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double expected = before[i] + offset(places[i]);
      if (std::isnan(expected)) {
        EXPECT_TRUE(std::isnan(heights[i]));
      } else {
        EXPECT_NEAR(heights[i], expected, kTolerance + 1e-9) << places[i][0] << "," << places[i][1];
      }
    }
    return asked;
  }

  std::uint64_t seed_ = 71;
};

/// Bilinear between random values on a grid, like vertical grids, with differences of some
/// centimetres per kilometre.
double on_grid(const Point2& p, double cells_per_degree) {
  const auto value = [](double x, double y) {
    const auto number = static_cast<std::uint64_t>(std::int64_t{1} << 40) +
                        static_cast<std::uint64_t>(x) * 7919 + static_cast<std::uint64_t>(y);
    return 40.0 + base::unit_interval(base::splitmix64(number));
  };
  const double x = (p[0] + 360) * cells_per_degree, y = (p[1] + 90) * cells_per_degree;
  const double fx = x - std::floor(x), fy = y - std::floor(y);
  const auto row = [&](double at) {
    return (1 - fx) * value(std::floor(x), at) + fx * value(std::floor(x) + 1, at);
  };
  return (1 - fy) * row(std::floor(y)) + fy * row(std::floor(y) + 1);
}

TEST_F(SmoothOffsets, MatchSingleQueriesOnGrids) {
  for (const double cells : {4.0, 24.0, 60.0, 7.3}) {
    for (const double size : {0.001, 0.05, 0.6}) {
      SCOPED_TRACE(testing::Message() << cells << " cells per degree, places in " << size);
      const Point2 low{-10 + 20 * random(), 40 + 10 * random()};
      const auto offset = [&](const Point2& p) { return on_grid(p, cells); };
      const std::size_t asked = check(places(20000, low, {size, 0.7 * size}), offset);
      // Polynomials answer most queries only if the box has few cells.
      if (cells != 7.3 && size * cells < 4) {
        EXPECT_LT(asked, 4000u);
      }
    }
  }
}

TEST_F(SmoothOffsets, MatchSingleQueriesOnSmoothFunctions) {
  const auto wave = [](const Point2& p) { return 50 * std::sin(p[0] / 9) * std::cos(p[1] / 7); };
  EXPECT_LT(check(places(20000, {170, -30}, {0.5, 0.5}), wave), 100u);
  check(places(20000, {-180, -90}, {360, 180}), wave);
  // Along a line, at a single place, and for few places.
  EXPECT_LT(check(places(5000, {12, 40}, {0, 0.5}), wave), 100u);
  EXPECT_LT(check(places(5000, {12, 40}, {0.5, 0}), wave), 100u);
  EXPECT_LT(check(places(5000, {12, 40}, {0, 0}), wave), 100u);
  check(places(7, {12, 40}, {1, 1}), wave);
  check({}, wave);
}

TEST_F(SmoothOffsets, EndAtGridBorder) {
  const auto ends = [](const Point2& p) {
    return p[0] > 12.3 && p[1] > 40.1 ? 44 + 0.1 * p[0] : std::numeric_limits<double>::quiet_NaN();
  };
  check(places(20000, {12, 40}, {0.5, 0.5}), ends);
  check(places(3000, {12, 40}, {0.2, 0.2}), ends);
  std::vector<Point2> some = places(3000, {12, 40}, {0.5, 0.5});
  for (std::size_t i = 0; i < some.size(); i += 17) {
    some[i][i % 2] = std::numeric_limits<double>::quiet_NaN();
  }
  check(some, [](const Point2& p) { return p[0] + p[1]; });
}

TEST(QuinticSurface, ReproducesPolynomials) {
  const auto f = [](double s, double t) {
    return 3 + s * (1 - t * t * t) + 2 * s * s * s * s * s * t - t * t;
  };
  std::array<double, QuinticSurface::kPlaces> values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = f(QuinticSurface::places()[i][0], QuinticSurface::places()[i][1]);
  }
  const auto surface = QuinticSurface::through(values, 1e-9);
  ASSERT_TRUE(surface);
  EXPECT_FALSE(surface->is_bilinear(0.1));
  for (double s = 0; s <= 1; s += 0.125) {
    for (double t = 0; t <= 1; t += 0.125) EXPECT_NEAR(surface->at(s, t), f(s, t), 1e-12);
  }
  values.back() += 1e-6;
  EXPECT_FALSE(QuinticSurface::through(values, 1e-6));
}

}  // namespace
}  // namespace terrace::terrain
