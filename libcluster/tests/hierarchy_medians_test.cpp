// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "hierarchy/block.hpp"
#include "hierarchy_laws.hpp"
#include "inputs.hpp"
#include "recording_sink.hpp"
#include "terrace/cluster/hierarchy.hpp"
#include "terrace/cluster/k_median.hpp"

/// k-median over a stream (HierarchyOptions::medians), compared with k_median() of all points.

namespace terrace::cluster {
namespace {

struct MedianHierarchy {
  RecordingSink sink;
  HierarchyResult result;
};

HierarchyOptions median_options(std::size_t k, std::size_t block_size) {
  HierarchyOptions options;
  options.block_size = block_size;
  options.medians = k;
  options.payload_size = sizeof(std::uint64_t);
  return options;
}

void build_medians(const HierarchyOptions& options, std::span<const Point3> points,
                   MedianHierarchy& built) {
  constexpr std::size_t kBatch = 37;
  HierarchyBuilder builder(options, built.sink);
  for (std::size_t i = 0; i < points.size(); i += kBatch) {
    const std::size_t end = std::min(i + kBatch, points.size());
    builder.push(points.subspan(i, end - i), numbered_payload(i, end));
  }
  built.result = builder.finish();
}

/// Returns the sum of distances to the nearest medians.
double cost_of_medians(std::span<const Point3> points, std::span<const Point3> medians,
                       const Metric& metric = Euclidean{}) {
  double sum = 0.0;
  for (const Point3& p : points) {
    double least = std::numeric_limits<double>::infinity();
    for (const Point3& m : medians) least = std::min(least, distance(metric, m, p));
    sum += least;
  }
  return sum;
}

struct NamedPoints {
  std::string name;
  std::vector<Point3> points;
};

std::vector<NamedPoints> named_points(std::size_t count, std::mt19937_64& random) {
  using inputs::bell;
  using inputs::uniform;
  std::vector<NamedPoints> all;
  const auto add = [&](const char* name, const auto& point) {
    all.push_back({name, {}});
    for (std::size_t i = 0; i < count; ++i) all.back().points.push_back(point(i));
  };
  std::vector<Point3> centres = inputs::cube(7, random);
  add("cube", [&](std::size_t) { return inputs::cube(1, random)[0]; });
  add("sorted square", [&](std::size_t i) {
    return Point3{static_cast<double>(i) + uniform(random), 1000 * uniform(random), 5e6};
  });
  add("clumps", [&](std::size_t) {
    const Point3& c = centres[random() % centres.size()];
    return Point3{1e4 * c[0] + bell(random), 1e4 * c[1] + bell(random), c[2]};
  });
  add("line", [&](std::size_t) {
    const double t = uniform(random);
    return Point3{t, 2 * t, -t};
  });
  add("duplicates", [&](std::size_t) {
    return Point3{static_cast<double>(random() % 12), static_cast<double>(random() % 9), 0.0};
  });
  add("far tails", [&](std::size_t) {
    const double s = 1.0 / (1e-3 + uniform(random));
    return Point3{s * bell(random), s * bell(random), s * bell(random)};
  });
  add("lattice", [&](std::size_t i) {
    return Point3{static_cast<double>(i % 40), static_cast<double>(i / 40), 0.0};
  });
  return all;
}

TEST(HierarchyMedians, CostIsNearThatInMemory) {
  for (const std::uint64_t seed : {1u, 2u}) {
    std::mt19937_64 random(seed);
    for (const NamedPoints& input : named_points(2000 / TERRACE_TEST_SHARE, random)) {
      const std::size_t block_size = 400 * seed / TERRACE_TEST_SHARE;
      const std::size_t k = 4 / TERRACE_TEST_SHARE + seed - 1;
      SCOPED_TRACE(testing::Message() << input.name << ", seed " << seed << ", k " << k);
      MedianHierarchy built;
      build_medians(median_options(k, block_size), input.points, built);
      laws::check_hierarchy(built.sink, built.result, input.points, block_size,
                            {1, 0, 0, 0, 1, 0, 0, 0, 1}, k);
      ASSERT_EQ(built.sink.top.positions.size(), k);
      EXPECT_GE(built.result.top, 2u);
      const FacilitySolution memory = k_median(FacilityPoints{.points = input.points}, k);
      EXPECT_LE(cost_of_medians(input.points, built.sink.top.positions),
                1.05 * memory.connection_cost);
    }
  }
}

TEST(HierarchyMedians, OneBlockIsTheProblemInMemory) {
  std::mt19937_64 random(3);
  const std::vector<Point3> points = inputs::cube(300, random);
  MedianHierarchy built;
  build_medians(median_options(12, 300), points, built);
  laws::check_hierarchy(built.sink, built.result, points, 300, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 12);
  EXPECT_EQ(built.result.top, 1u);
  const FacilitySolution memory =
      k_median(FacilityPoints{.points = points}, 12,
               {.restarts = 1, .bound_steps = 0, .seed = block_seed(1, 0, 0)});
  const RecordedBlock& block = built.sink.levels[0][0];
  EXPECT_EQ(block.representatives, memory.facilities);
  for (std::uint32_t c = 0; c < 12; ++c) {
    for (const std::uint32_t i : block.members(c)) EXPECT_EQ(memory.assignment[i], c);
  }
}

TEST(HierarchyMedians, BlocksKeepAQuarterOfTheirPoints) {
  std::mt19937_64 random(4);
  for (const NamedPoints& input : named_points(3000 / TERRACE_TEST_SHARE, random)) {
    SCOPED_TRACE(input.name);
    MedianHierarchy built;
    HierarchyOptions options = median_options(3, 300);
    options.block.facility_cost = 1e9;  // is not used
    build_medians(options, input.points, built);
    for (unsigned level = 0; level + 1 < built.result.top; ++level) {
      for (const RecordedBlock& block : built.sink.levels[level]) {
        std::vector<Point3> distinct = block.positions;
        std::sort(distinct.begin(), distinct.end());
        distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
        const std::size_t most = std::min(distinct.size(), (block.positions.size() + 1) / 2);
        EXPECT_GE(block.representatives.size(), std::min(most, block.positions.size() / 4));
      }
    }
  }
}

TEST(HierarchyMedians, MetricsWeighTheSameOnTheGround) {
  std::mt19937_64 random(5);
  const std::vector<Point3> points = inputs::cube(1200, random);
  const GroundMap map{3, 0, 0, 0, 1, 0, 0, 0, 0};
  std::vector<Point3> ground;
  for (const Point3& p : points) ground.push_back({3 * p[0], p[1], 0});
  for (const Metric& metric : {Metric{Euclidean{}}, Metric{Minkowski{1.0}}}) {
    HierarchyOptions options = median_options(4, 400);
    options.metric = metric;
    options.ground = [&](const Box3&) { return map; };
    MedianHierarchy built;
    build_medians(options, points, built);
    std::vector<Point3> medians;
    for (const Point3& p : built.sink.top.positions) medians.push_back({3 * p[0], p[1], 0});
    const FacilitySolution memory = k_median(FacilityPoints{.points = ground, .metric = metric}, 4);
    EXPECT_LE(cost_of_medians(ground, medians, metric), 1.05 * memory.connection_cost);
  }
}

TEST(HierarchyMedians, FewPointsAreAllAtTheTop) {
  std::mt19937_64 random(6);
  for (const std::size_t count : {0u, 1u, 5u, 6u, 7u}) {
    const std::vector<Point3> points = inputs::cube(count, random);
    MedianHierarchy built;
    build_medians(median_options(6, 50), points, built);
    laws::check_hierarchy(built.sink, built.result, points, 50, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 6);
    EXPECT_EQ(built.sink.top.positions.size(), std::min<std::size_t>(count, 6));
  }
  // Copies of one point cost nothing.
  const std::vector<Point3> copies(500, Point3{1e6, 2, 3});
  MedianHierarchy built;
  build_medians(median_options(6, 50), copies, built);
  laws::check_hierarchy(built.sink, built.result, copies, 50, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 6);
  EXPECT_LE(built.sink.top.positions.size(), 6u);
}

TEST(HierarchyMedians, ThreadsDoNotChangeThem) {
  std::mt19937_64 random(7);
  const std::vector<Point3> points = inputs::cube(3000 / TERRACE_TEST_SHARE, random);
  MedianHierarchy one;
  build_medians(median_options(5, 250), points, one);
  for (const unsigned threads : {2u, 5u}) {
    HierarchyOptions options = median_options(5, 250);
    options.threads = threads;
    MedianHierarchy other;
    build_medians(options, points, other);
    EXPECT_TRUE(other.sink.levels == one.sink.levels);
    EXPECT_TRUE(other.sink.top == one.sink.top);
  }
}

TEST(HierarchyMedians, AStopEndsTheSearch) {
  std::mt19937_64 random(8);
  const std::vector<Point3> points = inputs::cube(400, random);
  std::stop_source stop;
  HierarchyOptions options = median_options(40, 400);
  options.stop = stop.get_token();
  stop.request_stop();
  MedianHierarchy built;
  build_medians(options, points, built);  // a real sink throws
  EXPECT_EQ(built.sink.levels[0][0].representatives.size(), 200u);
}

TEST(HierarchyMedians, InvalidOptionsAreRefused) {
  const auto refused = [](const HierarchyOptions& options) {
    RecordingSink sink;
    EXPECT_THROW(HierarchyBuilder(options, sink), std::invalid_argument);
  };
  refused(median_options(100, 100));
  HierarchyOptions outliers = median_options(5, 100);
  outliers.outlier_price = 1.0;
  outliers.mark_outlier = [](std::span<std::byte>) {};
  refused(outliers);
  HierarchyOptions entities = median_options(5, 100);
  entities.corners.count = 2;
  entities.corners.read = [](std::span<const std::byte>, std::span<Point3>) {};
  refused(entities);
}

}  // namespace
}  // namespace terrace::cluster
