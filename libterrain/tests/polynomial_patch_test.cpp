// SPDX-License-Identifier: Apache-2.0
#include "earth/polynomial_patch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/random.hpp>

namespace terrace::terrain {
namespace {

/// Returns the patch of two functions of the plane.
template <class Patch, class F, class G>
std::optional<Patch> fit(const Point2& low, const Point2& size, double tolerance, const F& f,
                         const G& g) {
  auto places = Patch::places(low, size);
  for (Point2& p : places) p = {f(p[0], p[1]), g(p[0], p[1])};
  return Patch::through(places, tolerance);
}

template <class Patch, class F, class G>
void expect_equal(const F& f, const G& g) {
  const Point2 low{0.3, -0.2}, size{2, 0.5};
  const auto patch = fit<Patch>(low, size, 1e-9, f, g);
  ASSERT_TRUE(patch);
  for (double t = 0; t <= 1; t += 0.125) {
    const auto row = patch->row(t);
    for (double s = 0; s <= 1; s += 0.125) {
      const double x = low[0] + s * size[0], y = low[1] + t * size[1];
      EXPECT_NEAR(row(0, s), f(x, y), 1e-9);
      EXPECT_NEAR(row(1, s), g(x, y), 1e-9);
      EXPECT_EQ(row(0, s), patch->at(0, s, t));
    }
  }
}

TEST(PolynomialPatch, ReproducesPolynomials) {
  const auto plane = [](double x, double y) { return 3 - 2 * x + y + 0.5 * x * y; };
  const auto quadratic = [](double x, double y) { return 1 + x * x * y * y - y * y + x; };
  const auto quintic = [](double x, double y) {
    return 3 + x * (1 - y * y * y) + 0.01 * x * x * x * x * x * y - y * y;
  };
  expect_equal<PolynomialPatch<2, 2>>(plane, quadratic);
  expect_equal<PolynomialPatch<5, 2>>(quintic, quadratic);
  EXPECT_FALSE((fit<PolynomialPatch<2, 2>>({0.3, -0.2}, {2, 0.5}, 1e-9, plane, quintic)));
  const auto both = fit<PolynomialPatch<5, 2>>({0, 0}, {1, 1}, 1e-9, plane, quintic);
  ASSERT_TRUE(both);
  EXPECT_TRUE(both->is_bilinear(0, 1e-9));
  EXPECT_FALSE(both->is_bilinear(1, 0.1));
  EXPECT_NEAR(both->bilinear_at(0, 0.3, 0.7), plane(0.3, 0.7), 1e-12);
}

TEST(PolynomialPatch, RefusesAnErrorAtAnyCheckedPlace) {
  const auto values = PlacePatch::places({0, 0}, {1, 1});  // a linear function
  EXPECT_TRUE(PlacePatch::through(values, 1e-10));
  for (std::size_t i = 36; i < PlacePatch::kPlaces; ++i) {
    for (const double off : {1e-6, -1e-6, std::nan("")}) {
      auto changed = values;
      changed[i][i % 2] += off;
      EXPECT_FALSE(PlacePatch::through(changed, 1e-6));
    }
  }
}

/// Checks the documented bound: every patch of a smooth function is within the tolerance in the
/// whole box.
template <std::size_t kDegree>
void expect_bound(double tolerance) {
  using Patch = PolynomialPatch<kDegree, 2>;
  std::size_t made = 0, refused = 0;
  for (std::uint64_t seed = 1; seed <= 600; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::uint64_t state = seed;
    const auto unit = [&state] {
      state = base::splitmix64(state);
      return base::unit_interval(state);
    };
    // A wave, and a function with a pole near the box, as projections have.
    const double angle = 6.3 * unit(), phase = 6.3 * unit();
    const Point2 wave{std::cos(angle), std::sin(angle)}, pole{-0.2 - 5 * unit(), 2 * unit() - 0.5};
    const auto f = [&](double x, double y) { return std::sin(phase + wave[0] * x + wave[1] * y); };
    const auto g = [&](double x, double y) {
      return std::log(std::hypot(x - pole[0], y - pole[1]));
    };
    const double width = std::pow(10, 1 - 4 * unit()), height = width * unit();
    const auto patch = fit<Patch>({0, 0}, {width, height}, tolerance, f, g);
    ++(patch ? made : refused);
    if (!patch) continue;
    double worst = 0;
    for (int j = 0; j <= 40; ++j) {
      for (int i = 0; i <= 40; ++i) {
        const double s = i / 40.0, t = j / 40.0;
        worst = std::max({worst, std::abs(patch->at(0, s, t) - f(s * width, t * height)),
                          std::abs(patch->at(1, s, t) - g(s * width, t * height))});
      }
    }
    EXPECT_LE(worst, tolerance);
  }
  EXPECT_GT(made, 100U);
  EXPECT_GT(refused, 100U);
}

TEST(PolynomialPatch, KeepsItsBoundBetweenCheckedPlaces) {
  expect_bound<5>(1e-6);
  expect_bound<2>(1e-3);
}

TEST(LatticePart, DividesIntoEveryCellOnce) {
  constexpr std::size_t kAcross = 37, kDown = 20;
  std::vector<int> seen(kAcross * kDown);
  divide({0, 0, kAcross, kDown}, [&](const LatticePart& part) {
    if (part.columns * part.rows > 12) return false;
    for (std::size_t j = part.row; j < part.row + part.rows; ++j) {
      for (std::size_t i = part.column; i < part.column + part.columns; ++i) {
        ++seen[j * kAcross + i];
      }
    }
    return true;
  });
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<int>(seen.size()));
}

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
  // Test places along a line, a single place, and few places.
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

}  // namespace
}  // namespace terrace::terrain
