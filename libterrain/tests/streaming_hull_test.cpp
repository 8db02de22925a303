// SPDX-License-Identifier: Apache-2.0
#include "base/streaming_hull.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/tri/predicates.hpp>

namespace terrace::terrain {
namespace {

/// Makes places with few different coordinates, so that many are collinear or equal, or with many.
std::vector<Point2> places(std::uint64_t seed, std::size_t count) {
  std::mt19937_64 engine(seed);
  const bool few = seed % 2 == 0;
  const double step = seed % 3 == 0 ? 0.1 : 1.0;
  std::vector<Point2> out;
  for (std::size_t i = 0; i < count; ++i) {
    if (few) {
      out.push_back(
          {static_cast<double>(engine() % 7) * step, static_cast<double>(engine() % 5) * step});
    } else {
      out.push_back({static_cast<double>(engine() >> 11) * 0x1p-53,
                     static_cast<double>(engine() >> 11) * 0x1p-40});
    }
  }
  return out;
}

/// Whether all places are to the left of a to b, or on it.
bool supports(const Point2& a, const Point2& b, const std::vector<Point2>& all) {
  return std::all_of(all.begin(), all.end(),
                     [&](const Point2& p) { return tri::orientation(a, b, p) >= 0; });
}

TEST(ConvexHull, ReturnsCornersInOrder) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<Point2> all = places(seed, 1 + seed % 40);
    const std::vector<Point2> hull = convex_hull(all);
    for (const Point2& corner : hull) {
      EXPECT_NE(std::find(all.begin(), all.end(), corner), all.end());
    }
    if (hull.size() < 3) {
      for (const Point2& p : all) EXPECT_EQ(tri::orientation(hull.front(), hull.back(), p), 0);
      continue;
    }
    EXPECT_EQ(hull.front(), *std::min_element(all.begin(), all.end()));
    for (std::size_t i = 0; i < hull.size(); ++i) {
      const Point2 &a = hull[i], &b = hull[(i + 1) % hull.size()], &c = hull[(i + 2) % hull.size()];
      EXPECT_TRUE(supports(a, b, all));
      EXPECT_EQ(tri::orientation(a, b, c), 1);
    }
    // With the points on the sides, the hull has every place of the border once.
    const std::vector<Point2> border = convex_hull(all, true);
    for (std::size_t i = 0; i < border.size(); ++i) {
      EXPECT_TRUE(supports(border[i], border[(i + 1) % border.size()], all));
      EXPECT_EQ(std::count(border.begin(), border.end(), border[i]), 1);
    }
    for (const Point2& p : all) {
      bool on_side = false;
      for (std::size_t i = 0; i < hull.size(); ++i) {
        on_side = on_side || tri::orientation(hull[i], hull[(i + 1) % hull.size()], p) == 0;
      }
      EXPECT_EQ(on_side, std::find(border.begin(), border.end(), p) != border.end());
    }
  }
}

TEST(ConvexHull, StreamingMatchesBatch) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    std::vector<Point2> all = places(seed, 30000);
    if (seed % 4 == 1) {
      // On a circle all points, or nearly all, are corners.
      for (std::size_t i = 0; i < all.size(); ++i) {
        const double angle = static_cast<double>(i) * 0.7;
        all[i] = {std::cos(angle), std::sin(angle)};
      }
    }
    if (seed % 4 == 3) std::sort(all.begin(), all.end());
    StreamingHull hull;
    for (const Point2& p : all) hull.add(p);
    EXPECT_EQ(hull.corners(), convex_hull(all));
  }
}

TEST(ConvexHull, CrossingsAreOutsideOrOnTheBorder) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<Point2> hull = convex_hull(places(seed, 40));
    if (hull.size() < 3) continue;
    const auto outside = [&](const Point2& p) {
      for (std::size_t i = 0; i < hull.size(); ++i) {
        if (tri::orientation(hull[i], hull[(i + 1) % hull.size()], p) <= 0) return true;
      }
      return false;
    };
    for (const unsigned axis : {0U, 1U}) {
      double low = hull[0][axis], high = low;
      for (const Point2& p : hull) low = std::min(low, p[axis]), high = std::max(high, p[axis]);
      EXPECT_FALSE(crossings(hull, axis, high + 1).has_value());
      for (const double part : {0.0, 0.1, 0.37, 0.5, 1.0}) {
        const double c = part == 1.0 ? high : low + part * (high - low);
        const auto found = crossings(hull, axis, c);
        ASSERT_TRUE(found.has_value());
        EXPECT_LE((*found)[0], (*found)[1]);
        const auto at = [&](double t) { return axis == 0 ? Point2{c, t} : Point2{t, c}; };
        EXPECT_TRUE(outside(at((*found)[0])));
        EXPECT_TRUE(outside(at((*found)[1])));
        // Off by at most a rounding error.
        const double size = (*found)[1] - (*found)[0];
        if (size > 1e-6 && part > 0 && part < 1) {
          EXPECT_FALSE(outside(at((*found)[0] + 1e-9 * size))) << part;
          EXPECT_FALSE(outside(at((*found)[1] - 1e-9 * size))) << part;
        }
      }
    }
  }
}

}  // namespace
}  // namespace terrace::terrain
