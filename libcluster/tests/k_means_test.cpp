// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/k_means.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "inputs.hpp"

namespace terrace::cluster {
namespace {

double squared(const Point3& a, const Point3& b) {
  const double x = a[0] - b[0];
  const double y = a[1] - b[1];
  const double z = a[2] - b[2];
  return x * x + y * y + z * z;
}

std::vector<std::uint32_t> nearest(const std::vector<Point3>& centres,
                                   const std::vector<Point3>& points) {
  std::vector<std::uint32_t> assignment;
  for (const Point3& p : points) {
    std::uint32_t best = 0;
    for (std::uint32_t c = 1; c < centres.size(); ++c) {
      if (squared(p, centres[c]) < squared(p, centres[best])) best = c;
    }
    assignment.push_back(best);
  }
  return assignment;
}

std::size_t count_of(const std::vector<std::uint32_t>& assignment, std::uint32_t cluster) {
  return static_cast<std::size_t>(std::count(assignment.begin(), assignment.end(), cluster));
}

/// Runs textbook Lloyd iterations, with the rule of k_means.hpp for empty clusters.
KMeansResult plain_lloyd(std::vector<Point3> centres, std::vector<Point3> points,
                         std::vector<double> weights, std::size_t max_iterations) {
  // Relative to the least coordinates, so that means are rounded as in the library.
  Point3 corner = points.front();
  for (const Point3& p : points) {
    for (unsigned axis = 0; axis < 3; ++axis) corner[axis] = std::min(corner[axis], p[axis]);
  }
  const auto shift = [&](std::vector<Point3>& list, double sign) {
    for (Point3& p : list) {
      for (unsigned axis = 0; axis < 3; ++axis) p[axis] += sign * corner[axis];
    }
  };
  shift(points, -1);
  shift(centres, -1);
  weights.resize(points.size(), 1.0);
  const auto cost = [&](std::size_t i, const std::vector<std::uint32_t>& assignment) {
    return weights[i] * squared(points[i], centres[assignment[i]]);
  };

  KMeansResult result;
  while (result.iterations < max_iterations && !result.converged) {
    std::vector<std::uint32_t> assignment = nearest(centres, points);
    ++result.iterations;
    bool moved = false;
    const std::vector<std::uint32_t> before = assignment;
    for (std::uint32_t c = 0; c < centres.size(); ++c) {
      if (count_of(before, c) > 0) continue;
      std::size_t most = points.size();
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (assignment[i] != before[i] || count_of(assignment, assignment[i]) < 2) continue;
        if (squared(points[i], centres[assignment[i]]) < 1e-20) continue;
        if (most == points.size() || cost(i, before) > cost(most, before)) most = i;
      }
      if (most == points.size()) continue;
      assignment[most] = c;
      moved = true;
    }
    result.converged = !moved && assignment == result.assignment;
    result.assignment = assignment;
    if (result.converged) break;
    for (std::uint32_t c = 0; c < centres.size(); ++c) {
      Point3 sum{};
      double weight = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (assignment[i] != c) continue;
        for (unsigned axis = 0; axis < 3; ++axis) sum[axis] += weights[i] * points[i][axis];
        weight += weights[i];
      }
      if (weight > 0) centres[c] = {sum[0] / weight, sum[1] / weight, sum[2] / weight};
    }
  }
  result.assignment = nearest(centres, points);
  for (std::size_t i = 0; i < points.size(); ++i) result.sse += cost(i, result.assignment);
  shift(centres, 1);
  result.centres = centres;
  return result;
}

/// Makes inputs of several kinds: uniform, a plane, a grid with ties and duplicates, a line, tight
/// clusters.
std::vector<Point3> make_points(std::uint64_t kind, std::size_t count, std::mt19937_64& random) {
  std::vector<Point3> points = inputs::cube(count, random);
  for (Point3& p : points) {
    switch (kind) {
      case 1:
        p[2] = 0;
        break;
      case 2:
        for (double& v : p) v = std::floor(v * 4);
        break;
      case 3:
        p = {p[0] + 5, 2 * p[0], 0};
        break;
      case 4:
        for (double& v : p) v = std::floor(v * 3) * 1000 + inputs::bell(random);
        break;
      default:
        break;
    }
  }
  return points;
}

void expect_equal(const KMeansResult& ours, const KMeansResult& plain, double size) {
  ASSERT_EQ(ours.assignment, plain.assignment);
  EXPECT_EQ(ours.iterations, plain.iterations);
  EXPECT_EQ(ours.converged, plain.converged);
  EXPECT_NEAR(ours.sse, plain.sse, 1e-11 * plain.sse + 1e-20 * size * size);
  ASSERT_EQ(ours.centres.size(), plain.centres.size());
  for (std::size_t c = 0; c < ours.centres.size(); ++c) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      ASSERT_NEAR(ours.centres[c][axis], plain.centres[c][axis], 1e-11 * size);
    }
  }
}

TEST(KMeans, EqualsPlainLloyd) {
  std::size_t limited = 0;
  for (std::uint64_t seed = 1; seed <= 150; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::uint64_t kind = seed % 5;
    const std::size_t count = 2 + random() % (seed % 10 == 0 ? 1500 : 300);
    const std::vector<Point3> points = make_points(kind, count, random);
    std::vector<double> weights;
    if (seed % 3 == 0) {
      // Integer weights keep the ties of the grid.
      for (std::size_t i = 0; i < count; ++i) {
        weights.push_back(static_cast<double>(1 + random() % 9));
      }
    }
    const std::size_t k = 1 + random() % std::min<std::size_t>(count, 40);
    std::vector<Point3> centres;
    for (std::size_t c = 0; c < k; ++c) centres.push_back(points[random() % count]);
    // Some centres are outside, where they get no points.
    if (seed % 4 == 0) centres.back() = {-3, 7, seed % 8 == 0 ? 2.0 : 0.0};
    KMeansOptions options;
    options.max_iterations = seed % 7 == 0 ? seed % 4 : 1000;
    const KMeansResult ours = k_means_from(centres, points, weights, options);
    const KMeansResult plain = plain_lloyd(centres, points, weights, options.max_iterations);
    expect_equal(ours, plain, kind == 4 ? 3000.0 : 10.0);
    limited += plain.converged ? 0 : 1;
  }
  EXPECT_GT(limited, 0u);
}

TEST(KMeans, AssignsToTheNearestOfManyCentres) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::vector<Point3> points = make_points(seed % 5, 9000, random);
    std::vector<Point3> centres = make_points(seed % 5, 200, random);
    for (std::size_t c = 0; c < 20; ++c) centres[c] = centres[c + 100];
    centres[50] = {1e8, -1e8, 0};
    centres[51] = {1e300, 0, 0};
    KMeansOptions options;
    options.max_iterations = 0;
    const KMeansResult result = k_means_from(centres, points, {}, options);
    EXPECT_EQ(result.assignment, nearest(centres, points));
    EXPECT_EQ(result.iterations, 0u);
    EXPECT_FALSE(result.converged);
  }
}

TEST(KMeans, ThreadsDoNotChangeTheResult) {
  std::mt19937_64 random(3);
  std::vector<Point3> points = inputs::cube(60000, random);
  for (std::size_t i = 0; i < points.size() / 2; ++i) points[i][0] = 0.5 * points[i][1];
  KMeansOptions options;
  options.clusters = 60;
  options.max_iterations = 12;
  options.restarts = 2;
  const KMeansResult one = k_means(points, {}, options);
  for (const unsigned threads : {0u, 2u, 3u, 9u}) {
    options.threads = threads;
    const KMeansResult more = k_means(points, {}, options);
    EXPECT_EQ(one.assignment, more.assignment);
    EXPECT_EQ(one.centres, more.centres);
    EXPECT_EQ(one.sse, more.sse);
  }
}

TEST(KMeans, SeedsFindClustersFarApart) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    std::vector<Point3> points;
    for (std::size_t i = 0; i < 2700; ++i) {
      const auto place = static_cast<double>(i % 27);
      points.push_back({std::fmod(place, 3) * 1e3 + inputs::uniform(random),
                        std::fmod(std::floor(place / 3), 3) * 1e3 + inputs::uniform(random),
                        std::floor(place / 9) * 1e3 + inputs::uniform(random)});
    }
    KMeansOptions options;
    options.clusters = 27;
    options.seed = seed;
    options.max_iterations = 0;
    const KMeansResult seeds = k_means(points, {}, options);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_EQ(seeds.assignment[i], seeds.assignment[i % 27]);
    }
    for (const Point3& c : seeds.centres) {
      // Seeds are points, translated to the corner and back.
      const bool found = std::any_of(points.begin(), points.end(),
                                     [&](const Point3& p) { return squared(p, c) < 1e-18; });
      ASSERT_TRUE(found);
    }
    options.max_iterations = 100;
    const KMeansResult result = k_means(points, {}, options);
    EXPECT_TRUE(result.converged);
    EXPECT_EQ(result.iterations, 2u);
    EXPECT_LT(result.sse, 0.3 * 2700);  // the expectation is three times 1/12 per point
  }
}

TEST(KMeans, SeedsFollowTheWeights) {
  // With one cluster the only seed is drawn by weight, 1 : 3.
  const std::vector<Point3> points{{0, 0, 0}, {1, 0, 0}};
  const std::vector<double> weights{1, 3};
  KMeansOptions options;
  options.clusters = 1;
  options.max_iterations = 0;
  int heavy = 0;
  for (options.seed = 1; options.seed <= 1000; ++options.seed) {
    heavy += k_means(points, weights, options).centres[0][0] > 0.5 ? 1 : 0;
  }
  EXPECT_NEAR(heavy, 750, 60);
}

TEST(KMeans, RestartsKeepTheBestRun) {
  std::mt19937_64 random(8);
  const std::vector<Point3> points = inputs::cube(500, random);
  KMeansOptions options;
  options.clusters = 12;
  double last = std::numeric_limits<double>::infinity();
  std::size_t better = 0;
  for (options.restarts = 1; options.restarts <= 8; ++options.restarts) {
    const double sse = k_means(points, {}, options).sse;
    EXPECT_LE(sse, last);
    better += sse < last ? 1 : 0;
    last = sse;
  }
  EXPECT_GT(better, 1u);
}

TEST(KMeans, ToleranceEndsTheRunEarlier) {
  std::mt19937_64 random(9);
  const std::vector<Point3> points = inputs::cube(5000, random);
  KMeansOptions options;
  options.clusters = 30;
  const KMeansResult exact = k_means(points, {}, options);
  options.tolerance = 1e-2;
  const KMeansResult rough = k_means(points, {}, options);
  EXPECT_TRUE(exact.converged);
  EXPECT_TRUE(rough.converged);
  EXPECT_LT(rough.iterations, exact.iterations);
  EXPECT_GE(rough.sse, exact.sse);
  EXPECT_LE(rough.sse, 1.05 * exact.sse);
  EXPECT_EQ(rough.assignment, nearest(rough.centres, points));
}

TEST(KMeans, HandlesFewerDistinctPointsThanClusters) {
  KMeansOptions options;
  options.clusters = 7;
  for (const bool weighted : {false, true}) {
    std::vector<Point3> points;
    std::vector<double> weights;
    std::mt19937_64 random(4);
    for (std::size_t i = 0; i < 100; ++i) {
      points.push_back({0.1 * static_cast<double>(i % 3), 0.7, 0.3});
      if (weighted) weights.push_back(inputs::uniform(random) + 0.01);
    }
    const KMeansResult result = k_means(points, weights, options);
    EXPECT_TRUE(result.converged);
    EXPECT_EQ(result.centres.size(), 7u);
    EXPECT_NEAR(result.sse, 0.0, 1e-28);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(result.assignment[i], result.assignment[i % 3]);
    }
    EXPECT_NE(result.assignment[0], result.assignment[1]);
    EXPECT_NE(result.assignment[0], result.assignment[2]);
    EXPECT_NE(result.assignment[1], result.assignment[2]);
  }
  const std::vector<Point3> equal(50, Point3{3, -4, 5e10});
  const KMeansResult one = k_means(equal, {}, options);
  EXPECT_TRUE(one.converged);
  EXPECT_EQ(one.sse, 0.0);
  EXPECT_EQ(one.assignment, std::vector<std::uint32_t>(50, one.assignment[0]));
  EXPECT_EQ(one.centres, std::vector<Point3>(7, equal[0]));
}

TEST(KMeans, HandlesAsManyClustersAsPoints) {
  std::mt19937_64 random(10);
  const std::vector<Point3> points = inputs::cube(80, random);
  KMeansOptions options;
  options.clusters = points.size();
  const KMeansResult result = k_means(points, {}, options);
  EXPECT_EQ(result.sse, 0.0);
  std::vector<std::uint32_t> clusters = result.assignment;
  std::sort(clusters.begin(), clusters.end());
  EXPECT_EQ(std::unique(clusters.begin(), clusters.end()), clusters.end());
}

TEST(KMeans, AcceptsAnyScaleAndOffset) {
  std::mt19937_64 random(11);
  std::vector<Point3> points = inputs::cube(400, random);
  points[0] = {0, 0, 0};
  KMeansOptions options;
  options.clusters = 9;
  const KMeansResult unit = k_means(points, {}, options);
  for (const double scale : {0x1p-1000, 0x1p-990, 0x1p-300, 0x1p+300, 0x1p+1000, 0x1p+1023}) {
    SCOPED_TRACE(testing::Message() << "scale " << scale);
    std::vector<Point3> scaled = points;
    for (Point3& p : scaled) {
      for (double& v : p) v = v * scale;
    }
    const KMeansResult result = k_means(scaled, {}, options);
    EXPECT_EQ(result.assignment, unit.assignment);
    EXPECT_EQ(result.sse, unit.sse * scale * scale);
    for (std::size_t c = 0; c < 9; ++c) {
      for (unsigned axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(result.centres[c][axis] / scale, unit.centres[c][axis], 1e-12);
      }
    }
  }
  // The full range of double: the sides of the box exceed it.
  std::vector<Point3> wide = points;
  for (Point3& p : wide) {
    for (double& v : p) v = (v - 0.5) * std::numeric_limits<double>::max() * 2;
  }
  const KMeansResult result = k_means(wide, {}, options);
  EXPECT_EQ(result.assignment, unit.assignment);
  for (const Point3& c : result.centres) {
    for (const double v : c) EXPECT_TRUE(std::isfinite(v));
  }
  // Weights may have any scale.
  const std::vector<double> huge(points.size(), 0x1p+1000);
  EXPECT_EQ(k_means(points, huge, options).assignment, unit.assignment);
  std::vector<double> mixed(points.size(), 1e-300);
  mixed[5] = 1e300;
  const KMeansResult heavy = k_means(points, mixed, options);
  EXPECT_TRUE(std::isfinite(heavy.sse));
  EXPECT_LT(squared(heavy.centres[heavy.assignment[5]], points[5]), 1e-28);
}

std::string message(std::size_t clusters, const std::vector<Point3>& points,
                    const std::vector<double>& weights = {}, double tolerance = 0,
                    std::size_t restarts = 1) {
  KMeansOptions options;
  options.clusters = clusters;
  options.tolerance = tolerance;
  options.restarts = restarts;
  try {
    (void)k_means(points, weights, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(KMeans, RefusesBadInput) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const std::vector<Point3> points(4, Point3{1, 2, 3});
  const auto holds = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_EQ(message(4, points), "");
  EXPECT_TRUE(holds(message(0, points), "0 clusters of 4 points"));
  EXPECT_TRUE(holds(message(5, points), "5 clusters of 4 points"));
  EXPECT_TRUE(holds(message(1, {}), "1 clusters of 0 points"));
  std::vector<Point3> bad = points;
  bad[2][1] = std::nan("");
  EXPECT_TRUE(holds(message(1, bad), "point 2 "));
  bad[1][2] = -kInfinite;
  EXPECT_TRUE(holds(message(1, bad), "point 1 "));
  for (const double weight : {0.0, -1.0, kInfinite, std::nan("")}) {
    EXPECT_TRUE(holds(message(1, points, {1, 1, 1, weight}), "weight of point 3 "));
  }
  EXPECT_TRUE(holds(message(1, points, {}, -1.0), "tolerance"));
  EXPECT_TRUE(holds(message(1, points, {}, std::nan("")), "tolerance"));
  EXPECT_TRUE(holds(message(1, points, {}, 0.0, 0), "restarts"));
  try {
    (void)k_means_from(std::vector<Point3>{{0, 0, 0}, {kInfinite, 0, 0}}, points, {}, {});
    ADD_FAILURE() << "an infinite centre passed";
  } catch (const std::invalid_argument& error) {
    EXPECT_TRUE(holds(error.what(), "centre 1 "));
  }
}

TEST(KMeans, RepresentativeIsInItsClusterEvenIfSumsOverflow) {
  const std::vector<Point3> points{{0, 0, 0}, {1.7e308, 0, 0}, {1.6e308, 0, 0}};
  EXPECT_EQ(nearest_to_means(points, std::vector<std::uint32_t>{0, 1, 1}, 2),
            (std::vector<std::uint32_t>{0, 1}));
}

TEST(KMeans, RepresentativeIsNearestToTheMean) {
  std::mt19937_64 random(9);
  for (int round = 0; round < 20; ++round) {
    const std::size_t count = 1 + random() % 60, clusters = 1 + random() % 8;
    std::vector<Point3> points(count);
    std::vector<std::uint32_t> labels(count);
    for (std::size_t i = 0; i < count; ++i) {
      // There are few places, so that some are equally near.
      for (double& v : points[i]) v = static_cast<double>(random() % 5);
      labels[i] = static_cast<std::uint32_t>(random() % clusters);
    }
    const std::vector<std::uint32_t> found = nearest_to_means(points, labels, clusters);
    ASSERT_EQ(found.size(), clusters);
    for (std::uint32_t c = 0; c < clusters; ++c) {
      Point3 sum{};
      std::vector<std::uint32_t> members;
      for (std::uint32_t i = 0; i < count; ++i) {
        if (labels[i] != c) continue;
        members.push_back(i);
        for (std::size_t k = 0; k < 3; ++k) sum[k] += points[i][k];
      }
      if (members.empty()) {
        EXPECT_EQ(found[c], 0u);
        continue;
      }
      // Squares of n times the distance are whole numbers.
      const auto far2 = [&](std::uint32_t i) {
        double d2 = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const double d = static_cast<double>(members.size()) * points[i][k] - sum[k];
          d2 += d * d;
        }
        return d2;
      };
      EXPECT_EQ(labels[found[c]], c);
      for (const std::uint32_t i : members) {
        EXPECT_LE(far2(found[c]), far2(i) * (1 + 1e-12));
        if (i < found[c]) {
          EXPECT_GT(far2(i) * (1 + 1e-12), far2(found[c]));
        }
      }
    }
  }
}

}  // namespace
}  // namespace terrace::cluster
