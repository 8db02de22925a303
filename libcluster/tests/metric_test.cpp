// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/metric.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include <gtest/gtest.h>

#include "inputs.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {
namespace {

using inputs::kInfinity;
using inputs::kNaN;

double unit(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

Point3 random_point(std::mt19937_64& random) {
  return {20 * unit(random) - 10, 20 * unit(random) - 10, 20 * unit(random) - 10};
}

std::vector<Metric> all_metrics() {
  const double s = std::sqrt(0.5);
  const Elliptical along({3.0, 0.5, 2.0}, {s, s, 0, -s, s, 0, 0, 0, 1});
  return {Euclidean{},
          SquaredEuclidean{},
          Minkowski{1.0},
          Minkowski{3.5},
          Minkowski{kInfinity},
          Minkowski{0.5},
          Elliptical(2.0, 0.25, 30.0),
          along,
          EllipticalField({{{{-5, -5, -kInfinity}, {0, 0, kInfinity}}, Elliptical(4.0, 1.0, 70.0)},
                           {{{-1, -1, -1}, {6, 6, 6}}, along}}),
          CustomMetric{[](const Point3& f, const Point3& c) {
                         return std::abs(f[0] - c[0]) +
                                (c[1] > f[1] ? 2.0 : 1.0) * std::abs(f[1] - c[1]);
                       },
                       false, true}};
}

TEST(Metric, EveryRadiusOfTheEllipseHasLengthOne) {
  for (const double angle : {0.0, 30.0, 90.0, 135.0, -77.5, 1234.5}) {
    SCOPED_TRACE(angle);
    const double a = 3.0, b = 0.7, c = 12.0;
    const Elliptical metric(a, b, angle, c);
    const double turn = angle * std::numbers::pi / 180.0;
    for (int step = 0; step < 360; step += 7) {
      const double t = step * std::numbers::pi / 180.0;
      const double along = a * std::cos(t), across = b * std::sin(t);
      // The angle is counter-clockwise from +x.
      const Point3 radius{along * std::cos(turn) - across * std::sin(turn),
                          along * std::sin(turn) + across * std::cos(turn), 0.0};
      EXPECT_NEAR(distance(metric, {0, 0, 0}, radius), 1.0, 1e-14);
    }
    EXPECT_NEAR(distance(metric, {1, 1, 0}, {1, 1, c}), 1.0, 1e-15);
  }
}

TEST(Metric, SignOfM12IsThatOfACounterClockwiseAngle) {
  const Elliptical metric(2.0, 0.5, 30.0);
  const double sin = 0.5, cos = std::sqrt(0.75);
  EXPECT_NEAR(metric.map()[1], (1.0 / 2.0 - 1.0 / 0.5) * sin * cos, 1e-15);
  EXPECT_EQ(metric.map()[1], metric.map()[3]);
  EXPECT_NEAR(metric.map()[0], cos * cos / 2.0 + sin * sin / 0.5, 1e-15);
  EXPECT_EQ(metric.least_scale(), 0.5);
}

TEST(Metric, MultiplesOfARightAngleAreExact) {
  EXPECT_EQ(Elliptical(2.0, 0.5, 90.0).map(), (LinearMap{2, 0, 0, 0, 0.5, 0, 0, 0, 1}));
  EXPECT_EQ(Elliptical(2.0, 0.5, -180.0).map(), (LinearMap{0.5, 0, 0, 0, 2, 0, 0, 0, 1}));
}

TEST(Metric, MinkowskiTakesAbsoluteValuesAndSums) {
  const Point3 origin{0, 0, 0}, p{-3, 4, 0};
  EXPECT_EQ(distance(Minkowski{1.0}, origin, p), 7.0);
  EXPECT_NEAR(distance(Minkowski{2.0}, origin, p), 5.0, 1e-14);
  EXPECT_NEAR(distance(Minkowski{3.0}, origin, p), std::cbrt(27.0 + 64.0), 1e-14);
  EXPECT_EQ(distance(Minkowski{kInfinity}, origin, p), 4.0);
  EXPECT_NEAR(distance(Minkowski{2.0}, origin, {3e300, 4e300, 0}), 5e300, 1e286);
}

/// The C library's pow() gives different last bits for some of these.
TEST(Metric, PowersHaveTheSameBitsOnEveryMachine) {
  const auto of = [](double p) { return distance(Minkowski{p}, {0, 0, 0}, {1, 2.25, -0.3}); };
  EXPECT_EQ(of(1.5), 0x1.5eea974e767f3p+1);
  EXPECT_EQ(of(2.5), 0x1.2f4d903710bc5p+1);
  EXPECT_EQ(of(4), 0x1.22ca8edaae2ffp+1);
  EXPECT_EQ(of(0.75), 0x1.33262b366ab1bp+2);
}

TEST(Metric, PowersAgreeWithTheLibrary) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 2000; ++i) {
    const double p = 0.1 + 10 * inputs::uniform(random) * inputs::uniform(random);
    Point3 v;
    for (double& x : v) x = std::ldexp(inputs::uniform(random), -static_cast<int>(random() % 40));
    const double largest = std::max({v[0], v[1], v[2]});
    double sum = 0;
    for (const double x : v) sum += std::pow(x / largest, p);
    const double expected = largest * std::pow(sum, 1 / p);
    ASSERT_NEAR(distance(Minkowski{p}, {}, v), expected, 1e-14 * expected) << p;
  }
  // Covers ratios below the smallest normal number, and a root that overflows.
  EXPECT_DOUBLE_EQ(distance(Minkowski{0.01}, {}, {1, 1e-310, 0}),
                   std::pow(1 + std::pow(1e-310, 0.01), 100));
  EXPECT_EQ(distance(Minkowski{0.001}, {}, {1, 1, 1}), std::pow(3.0, 1000));
}

TEST(Metric, FieldUsesTheRegionOfTheFacility) {
  const EllipticalField field({{{{0, 0, -1}, {10, 10, 1}}, Elliptical(10.0, 10.0, 0.0, 10.0)}});
  const Point3 inside{5, 5, 0}, outside{-5, 5, 0};
  EXPECT_EQ(distance(field, inside, outside), 1.0);
  EXPECT_EQ(distance(field, outside, inside), 10.0);
  EXPECT_FALSE(is_symmetric(field));
  EXPECT_EQ(diagonal(field, {{0, 0, 0}, {3, 4, 0}}), 5.0);  // the Euclidean diagonal
  EXPECT_EQ(field.uniform_in({{1, 1, 0}, {2, 2, 0}})->at(0), 0.1);
  EXPECT_EQ(field.uniform_in({{-2, 1, 0}, {-1, 2, 0}}), kIdentityMap);
  EXPECT_FALSE(field.uniform_in({{-2, 1, 0}, {1, 2, 0}}));
}

TEST(Metric, BoxesOfAFieldMayBeInAnotherFrame) {
  // The frame turns a quarter, doubles lengths and translates: (x, y, z) is at (3 - 2y, 2x, z) in
  // it.
  const EllipticalField field({{{{1, 0, -1}, {3, 10, 1}}, Elliptical(10.0, 10.0, 0.0, 10.0)}},
                              EllipticalField::Frame{{0, -2, 0, 2, 0, 0, 0, 0, 1}, {3, 0, 0}});
  for (double x = -2; x <= 7; x += 0.25) {
    for (double y = -2; y <= 3; y += 0.25) {
      const bool inside = y >= 0 && y <= 1 && x >= 0 && x <= 5;
      EXPECT_EQ(field({x, y, 0})[0], inside ? 0.1 : 1.0) << x << ' ' << y;
    }
  }
  EXPECT_EQ(field.uniform_in({{0, 0, 0}, {5, 1, 0}})->at(0), 0.1);
  EXPECT_EQ(field.uniform_in({{5.25, 0, 0}, {7, 1, 0}}), kIdentityMap);
  EXPECT_FALSE(field.uniform_in({{4, 0, 0}, {7, 1, 0}}));
}

// A linear map must reproduce the distances of the metric.
TEST(Metric, LinearPointsKeepTheDistances) {
  std::mt19937_64 random(5);
  std::vector<Point3> points(50);
  for (Point3& p : points) p = random_point(random);
  int linear = 0;
  for (const Metric& metric : all_metrics()) {
    const auto mapped = linear_points(metric, points);
    EXPECT_EQ(mapped.has_value(), linear_map(metric, base::box_of(points)).has_value());
    if (!mapped) continue;
    ++linear;
    ASSERT_EQ(mapped->size(), points.size());
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const double d = distance(metric, points[i], points[i + 1]);
      EXPECT_NEAR(distance(Euclidean{}, (*mapped)[i], (*mapped)[i + 1]), d, 1e-13 * d);
    }
  }
  EXPECT_EQ(linear, 3);  // Euclidean and the two ellipses
  EXPECT_EQ(linear_points(Euclidean{}, points), points);
}

TEST(Metric, DeclaredPropertiesHold) {
  std::mt19937_64 random(7);
  for (const Metric& metric : all_metrics()) {
    SCOPED_TRACE(name_of(metric));
    bool symmetric = true, triangle = true;
    for (int trial = 0; trial < 20000; ++trial) {
      const Point3 a = random_point(random), b = random_point(random), c = random_point(random);
      EXPECT_EQ(distance(metric, a, a), 0.0);
      const double ab = distance(metric, a, b);
      EXPECT_GT(ab, 0.0);
      symmetric = symmetric && std::abs(ab - distance(metric, b, a)) <= 1e-12 * ab;
      triangle =
          triangle && distance(metric, a, c) <= (ab + distance(metric, b, c)) * (1.0 + 1e-12);
    }
    // The properties must be true, and no usable property may be undeclared.
    EXPECT_EQ(is_symmetric(metric), symmetric);
    EXPECT_EQ(obeys_triangle_inequality(metric), triangle);
  }
}

TEST(Metric, LeastScaleBoundsAllLengths) {
  std::mt19937_64 random(8);
  for (int trial = 0; trial < 200; ++trial) {
    const Elliptical metric(0.1 + 9 * unit(random), 0.1 + 9 * unit(random), 360 * unit(random),
                            0.1 + 9 * unit(random));
    for (int k = 0; k < 50; ++k) {
      const Point3 a = random_point(random), b = random_point(random);
      EXPECT_GE(distance(metric, a, b),
                metric.least_scale() * distance(Euclidean{}, a, b) * (1.0 - 1e-12));
    }
  }
}

TEST(Metric, TheDiagonalIsTheDiameterOfTheBox) {
  std::mt19937_64 random(9);
  const Box3 box{{-3, 2, 0}, {5, 4, 7}};
  for (const Metric& metric : all_metrics()) {
    if (std::holds_alternative<EllipticalField>(metric)) continue;
    SCOPED_TRACE(name_of(metric));
    const double length = diagonal(metric, box);
    for (int trial = 0; trial < 2000; ++trial) {
      Point3 p, q;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        p[axis] = box.min[axis] + unit(random) * (box.max[axis] - box.min[axis]);
        q[axis] = box.min[axis] + unit(random) * (box.max[axis] - box.min[axis]);
      }
      EXPECT_LE(distance(metric, p, q), length * (1.0 + 1e-12));
    }
    EXPECT_EQ(diagonal(metric, Box3{}), 0.0);
  }
}

TEST(Metric, RejectsDegenerateEllipses) {
  EXPECT_THROW(Elliptical(0.0, 1.0, 0.0), std::invalid_argument);
  EXPECT_THROW(Elliptical(1.0, -1.0, 0.0), std::invalid_argument);
  EXPECT_THROW(Elliptical(1.0, kInfinity, 0.0), std::invalid_argument);
  EXPECT_THROW(Elliptical(1.0, 1.0, kNaN), std::invalid_argument);
  EXPECT_THROW(Elliptical(1e-320, 1.0, 0.0), std::invalid_argument);
  EXPECT_THROW(Elliptical({1, 1, 1}, {1, 0, 0, 1, 0, 0, 0, 0, 1}), std::invalid_argument);
  EXPECT_THROW(EllipticalField({{{{0, 0, 0}, {-1, 1, 1}}, Elliptical(1, 1, 0)}}),
               std::invalid_argument);
  EXPECT_THROW(check(Metric(Minkowski{0.0})), std::invalid_argument);
  EXPECT_THROW(check(Metric(Minkowski{kNaN})), std::invalid_argument);
  EXPECT_THROW(check(Metric(CustomMetric{})), std::invalid_argument);
}

TEST(FacilityProblem, NamesBadInput) {
  const auto message = [](const auto& problem) -> std::string {
    try {
      check(problem);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  const std::vector<double> opening{1, 2}, costs{1, 2, 3, 4, -5, 6};
  EXPECT_NE(message(FacilityMatrix{2, 3, opening, costs}).find("client 1 to facility 1 is -5"),
            std::string::npos);
  const std::vector<double> missing{1, 2, 3, 4, kNaN, 6};
  EXPECT_NE(message(FacilityMatrix{2, 3, opening, missing}).find("client 1 to facility 1"),
            std::string::npos);
  EXPECT_NE(message(FacilityMatrix{2, 2, opening, costs}), "");
  EXPECT_NE(message(FacilityMatrix{0, 3, {}, {}}), "");

  const std::vector<Point3> points{{0, 0, 0}, {1, kNaN, 0}};
  EXPECT_NE(message(FacilityPoints{.points = points}).find("point 1"), std::string::npos);
  const std::vector<Point3> good{{0, 0, 0}, {1, 1, 0}};
  EXPECT_EQ(message(FacilityPoints{.points = good}), "");
  const std::vector<double> weights{1, 0};
  EXPECT_NE(message(FacilityPoints{.points = good, .weights = weights}).find("point 1"),
            std::string::npos);
  EXPECT_NE(message(FacilityPoints{.points = good, .facility_cost = 0.0}), "");
  EXPECT_NE(message(FacilityPoints{.points = {}}), "");
  const std::vector<double> values{1, kInfinity}, one{1.0};
  EXPECT_NE(message(FacilityPoints{.points = good, .channels = {values, one}}).find("point 1"),
            std::string::npos);
}

}  // namespace
}  // namespace terrace::cluster
