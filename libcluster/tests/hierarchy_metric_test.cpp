// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "hierarchy_laws.hpp"
#include "inputs.hpp"
#include "recording_sink.hpp"
#include "search_laws.hpp"
#include "terrace/cluster/hierarchy.hpp"

/// The streaming builder under various metrics and with channels.

namespace terrace::cluster {
namespace {

using inputs::kInfinity;

HierarchyResult build(const std::vector<Point3>& points, HierarchyOptions options,
                      RecordingSink& sink) {
  options.payload_size = sizeof(std::uint64_t);
  HierarchyBuilder builder(std::move(options), sink);
  for (std::size_t i = 0; i < points.size(); i += 50) {
    const std::size_t end = std::min(i + 50, points.size());
    builder.push(std::span(points).subspan(i, end - i), numbered_payload(i, end));
  }
  return builder.finish();
}

// Returns the sum over the clusters of a level of the distances from their representatives.
double connections(const RecordingSink& sink, const Metric& metric) {
  double sum = 0.0;
  for (const RecordedBlock& block : sink.levels[0]) {
    for (std::size_t c = 0; c < block.representatives.size(); ++c) {
      for (const std::uint32_t i : block.members(c)) {
        sum += distance(metric, block.positions[block.representatives[c]], block.positions[i]);
      }
    }
  }
  return sum;
}

TEST(HierarchyMetric, GuaranteesHoldUnderEveryMetric) {
  const GroundMap map{2, 0, 0, 0, 0.5, 0, 0, 0, 1};
  for (const Metric& metric : laws::metrics()) {
    for (const laws::OwnedProblem& input : laws::problems(400, 6)) {
      for (const bool mapped : {false, true}) {
        SCOPED_TRACE(name_of(metric) + ", " + input.name + (mapped ? ", mapped" : ""));
        HierarchyOptions options;
        options.block_size = 70;
        options.metric = metric;
        if (mapped) options.ground = [&](const Box3&) { return map; };
        RecordingSink sink, again;
        const HierarchyResult result = build(input.points, options, sink);
        // Errors are ground distances, whatever the metric.
        laws::check_hierarchy(sink, result, input.points, 70, mapped ? map : kIdentityMap);
        options.threads = 3;
        build(input.points, options, again);
        EXPECT_EQ(again.levels, sink.levels);
        EXPECT_EQ(again.top, sink.top);
      }
    }
  }
}

TEST(HierarchyMetric, ClustersFollowTheMetric) {
  std::mt19937_64 random(31);
  const std::vector<Point3> points = inputs::cube(3000, random);
  const Metric taxi = Minkowski{1.0};
  const Metric needles = Elliptical(10.0, 0.5, 20.0);
  const Metric field = EllipticalField(
      {{{{-kInfinity, -kInfinity, -kInfinity}, {0.5, kInfinity, kInfinity}}, {10.0, 0.5, 20.0}}});
  std::vector<RecordingSink> sinks(4);
  std::vector<HierarchyResult> results;
  const std::vector<Metric> metrics{Euclidean{}, taxi, needles, field};
  for (std::size_t k = 0; k < metrics.size(); ++k) {
    HierarchyOptions options;
    options.block_size = 1000;
    options.block.facility_cost = 0.5;
    options.metric = metrics[k];
    results.push_back(build(points, options, sinks[k]));
  }
  // Each metric beats the Euclidean one in its own distances, with about as many clusters.
  for (std::size_t k = 1; k < metrics.size(); ++k) {
    SCOPED_TRACE(name_of(metrics[k]));
    const auto clusters = static_cast<double>(results[k].level_clusters[0]);
    const auto euclidean_clusters = static_cast<double>(results[0].level_clusters[0]);
    if (k > 1) {
      EXPECT_LT(connections(sinks[k], metrics[k]) * std::cbrt(clusters),
                0.9 * connections(sinks[0], metrics[k]) * std::cbrt(euclidean_clusters));
    }
    EXPECT_NE(sinks[k].levels, sinks[0].levels);
  }
}

// The regions of a field are on the ground. In degrees they would be elsewhere.
TEST(HierarchyMetric, FieldsAreOnTheGround) {
  std::mt19937_64 random(32);
  std::vector<Point3> metres = inputs::cube(900, random);
  for (Point3& p : metres) p = {p[0] * 1024 + 0x1p20, p[1] * 1024 + 0x1p21, 0.0};
  std::vector<Point3> degrees = metres;
  for (Point3& p : degrees) p = {p[0] / 0x1p16, p[1] / 0x1p17, 0.0};
  HierarchyOptions options;
  options.block_size = 300;
  options.metric = EllipticalField(
      {{{{0x1p20, 0x1p21, -1}, {0x1p20 + 512, 0x1p21 + 700, 1}}, Elliptical(5.0, 1.0, 45.0)}});
  RecordingSink by_metres, by_degrees, plain;
  build(metres, options, by_metres);
  options.ground = [](const Box3&) { return GroundMap{0x1p16, 0, 0, 0, 0x1p17, 0, 0, 0, 1}; };
  build(degrees, options, by_degrees);
  ASSERT_EQ(by_metres.levels[0].size(), by_degrees.levels[0].size());
  for (std::size_t b = 0; b < by_metres.levels[0].size(); ++b) {
    EXPECT_EQ(by_metres.levels[0][b].order, by_degrees.levels[0][b].order);
    EXPECT_EQ(by_metres.levels[0][b].representatives, by_degrees.levels[0][b].representatives);
  }
  // The result is the same if blocks have different frames: here every other one is twice as large.
  const auto growth = [](const Box3& box) { return box.min[1] > 0x1p4 + 0x1p-9 ? 2.0 : 1.0; };
  options.ground = [&](const Box3& box) {
    return GroundMap{growth(box) * 0x1p16, 0, 0, 0, growth(box) * 0x1p17, 0, 0, 0, growth(box)};
  };
  options.metric = Euclidean{};
  options.metric_of = [&](const Box3& box) -> Metric {
    const double g = growth(box);
    return EllipticalField(
        {{{{g * 0x1p20, g * 0x1p21, -1}, {g * (0x1p20 + 512), g * (0x1p21 + 700), 1}},
          Elliptical(5.0, 1.0, 45.0)}});
  };
  RecordingSink by_blocks;
  build(degrees, options, by_blocks);
  for (std::size_t b = 0; b < by_blocks.levels[0].size(); ++b) {
    EXPECT_EQ(by_blocks.levels[0][b].representatives, by_degrees.levels[0][b].representatives);
  }
  options.metric_of = {};
  build(degrees, options, plain);
  EXPECT_NE(plain.levels[0][0].order, by_degrees.levels[0][0].order);
}

TEST(HierarchyMetric, PayloadChannelsSeparateClusters) {
  std::mt19937_64 random(33);
  const std::vector<Point3> points = inputs::cube(1200, random);
  HierarchyOptions options;
  options.block_size = 200;
  // Odd numbers are far from even ones.
  options.channels.weights = {50.0};
  options.channels.read = [](std::span<const std::byte> payload, std::span<double> values) {
    std::uint64_t id = 0;
    std::memcpy(&id, payload.data(), sizeof id);
    values[0] = static_cast<double>(id % 2);
  };
  options.block.facility_cost = 0.02;
  RecordingSink sink;
  const HierarchyResult result = build(points, options, sink);
  laws::check_hierarchy(sink, result, points, 200);
  ASSERT_GE(result.top, 1u);
  for (const auto& level : sink.levels) {
    for (const RecordedBlock& block : level) {
      for (std::size_t c = 0; c < block.representatives.size(); ++c) {
        for (const std::uint32_t i : block.members(c)) {
          EXPECT_EQ(block.id(i) % 2, block.id(block.representatives[c]) % 2);
        }
      }
    }
  }
}

TEST(HierarchyMetric, StopRequestEndsTheSearchOfABlock) {
  std::mt19937_64 random(3);
  const std::vector<Point3> points = inputs::cube(2000, random);
  const auto distances = [&](bool stopped) {
    std::atomic<std::uint64_t> count = 0;
    const Metric counted = CustomMetric{[&](const Point3& a, const Point3& b) {
                                          ++count;
                                          return distance(Euclidean{}, a, b);
                                        },
                                        true, true};
    HierarchyOptions options;
    options.block_size = 1000;
    options.block.effort = Effort::full;
    options.metric = counted;
    std::stop_source stop;
    options.stop = stop.get_token();
    if (stopped) stop.request_stop();
    RecordingSink sink;
    EXPECT_EQ(build(points, options, sink).points, points.size());
    return count.load();
  };
  EXPECT_LT(4 * distances(true), distances(false));
}

TEST(HierarchyMetric, NamesBadInput) {
  std::mt19937_64 random(34);
  const std::vector<Point3> points = inputs::cube(300, random);
  const auto message = [&](const HierarchyOptions& options) -> std::string {
    RecordingSink sink;
    try {
      build(points, options, sink);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  HierarchyOptions options;
  options.block_size = 100;
  options.metric = Minkowski{0.0};
  EXPECT_NE(message(options).find("Minkowski"), std::string::npos);
  options.metric = CustomMetric{};
  EXPECT_NE(message(options).find("function"), std::string::npos);
  options.metric = CustomMetric{[](const Point3& a, const Point3& b) { return a[0] - b[0]; }};
  EXPECT_NE(message(options).find("distance"), std::string::npos);
  options.metric = Euclidean{};
  options.channels.weights = {1.0, kInfinity};
  EXPECT_NE(message(options).find("channel 1"), std::string::npos);
  options.channels.weights = {1.0, 1.0};
  EXPECT_NE(message(options).find("function"), std::string::npos);
  options.channels.read = [](std::span<const std::byte>, std::span<double> values) {
    values[0] = 0.0;
    values[1] = std::nan("");
  };
  EXPECT_NE(message(options).find("channel 1 of point 0 in block 0 of level 0"), std::string::npos);
}

}  // namespace
}  // namespace terrace::cluster
