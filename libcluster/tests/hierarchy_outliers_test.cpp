// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "block/linear_block.hpp"
#include "hierarchy/block_clusterers.hpp"
#include "hierarchy_laws.hpp"
#include "inputs.hpp"
#include "recording_sink.hpp"
#include "search_laws.hpp"
#include "terrace/cluster/hierarchy.hpp"

/// Outliers in the stream (thesis 7.1.3, figure 7.3) and the strategies of its searches (7.3.2).

namespace terrace::cluster {
namespace {

struct Built {
  RecordingSink sink;
  HierarchyResult result;
  std::set<std::uint64_t> outliers;  // input indices

  Built(const std::vector<Point3>& points, HierarchyOptions options) {
    std::mutex mutex;
    options.payload_size = sizeof(std::uint64_t);
    options.mark_outlier = [&](std::span<std::byte> payload) {
      std::uint64_t id = 0;
      std::memcpy(&id, payload.data(), sizeof id);
      const std::lock_guard lock(mutex);
      EXPECT_TRUE(outliers.insert(id).second) << "marked twice";
    };
    HierarchyBuilder builder(std::move(options), sink);
    builder.push(points, numbered_payload(0, points.size()));
    result = builder.finish();
    EXPECT_EQ(result.outliers, outliers.size());
  }

  // Returns the input indices of the representatives of a level.
  [[nodiscard]] std::set<std::uint64_t> representatives(std::size_t level) const {
    std::set<std::uint64_t> ids;
    for (const RecordedBlock& block : sink.levels[level]) {
      for (const std::uint32_t r : block.representatives) ids.insert(block.id(r));
    }
    return ids;
  }
};

std::vector<FacilityStrategy> searches() {
  return {FacilityStrategy::automatic, FacilityStrategy::full_scan, FacilityStrategy::quadtree,
          FacilityStrategy::octree,    FacilityStrategy::kd_tree,   FacilityStrategy::facilities};
}

// A surface of one block with distant points. Their presence must change neither representatives
// nor clusters of the surface.
TEST(HierarchyOutliers, DoNotInfluenceClusters) {
  std::mt19937_64 random(71);
  const std::vector<Point3> surface = inputs::scan(2, 50, random);
  const Box3 box = base::box_of(surface);
  const double size = std::hypot(box.max[0] - box.min[0], box.max[1] - box.min[1]);
  std::vector<Point3> all = surface;
  const std::vector<std::pair<std::size_t, Point3>> birds{
      {3000, {box.min[0], box.min[1], box.max[2] + 40 * size}},
      {700, {box.min[0] - 3 * size, box.max[1], box.max[2] + size}},
      {0, {box.max[0], box.max[1], box.min[2] - 1000 * size}}};
  for (const auto& [at, place] : birds) {
    all.insert(all.begin() + static_cast<std::ptrdiff_t>(at), place);
  }
  const std::set<std::uint64_t> numbers{0, 701, 3002};  // positions after the later insertions
  // A point of the next block makes a level above.
  std::vector<Point3> surface_only = surface;
  for (std::vector<Point3>* points : {&all, &surface_only}) points->push_back(surface[0]);

  HierarchyOptions options;
  options.block.facility_cost = 1.0;
  options.outlier_price = 0.4;
  options.block_size = all.size() - 1;
  const Built with_outliers(all, options);
  EXPECT_EQ(with_outliers.outliers, numbers);
  laws::check_hierarchy(with_outliers.sink, with_outliers.result, all, options.block_size,
                        kIdentityMap);
  HierarchyOptions smaller = options;
  smaller.block_size = surface_only.size() - 1;
  const Built plain(surface_only, smaller);
  EXPECT_TRUE(plain.outliers.empty());
  const RecordedBlock& a = with_outliers.sink.levels[0][0];
  const RecordedBlock& b = plain.sink.levels[0][0];
  ASSERT_EQ(a.representatives.size(), b.representatives.size());
  for (std::size_t c = 0; c < a.representatives.size(); ++c) {
    EXPECT_EQ(a.positions[a.representatives[c]], b.positions[b.representatives[c]]);
    std::vector<Point3> members, others;
    for (const std::uint32_t i : a.members(c)) {
      if (!numbers.contains(a.id(i))) members.push_back(a.positions[i]);
    }
    for (const std::uint32_t i : b.members(c)) others.push_back(b.positions[i]);
    EXPECT_EQ(members, others) << "cluster " << c;
  }
  // Without the price they do change them, because the box is a thousand times as large.
  options.outlier_price = std::numeric_limits<double>::infinity();
  const Built steered(all, options);
  EXPECT_TRUE(steered.outliers.empty());
  EXPECT_NE(steered.representatives(0), with_outliers.representatives(0));
}

TEST(HierarchyOutliers, AreMarkedInASingleBlock) {
  std::mt19937_64 random(76);
  std::vector<Point3> points = inputs::cube(500, random);
  points[123] = {50, 50, 50};
  HierarchyOptions options;
  options.outlier_price = 0.1;
  const Built built(points, options);
  EXPECT_EQ(built.outliers, (std::set<std::uint64_t>{123}));
  EXPECT_EQ(built.result.top, 0u);
  laws::check_hierarchy(built.sink, built.result, points, options.block_size, kIdentityMap);
}

TEST(HierarchyOutliers, GuaranteesHoldForEveryInputPriceAndStrategy) {
  for (const laws::OwnedProblem& input : laws::problems(300, 8)) {
    for (const FacilityStrategy strategy : searches()) {
      for (const double price : {0.01, 0.3, 2.0}) {
        SCOPED_TRACE(input.name + ", " + name_of(strategy) + ", price " + std::to_string(price));
        HierarchyOptions options;
        options.block_size = 64;
        options.block.facility_cost = 0.3;
        options.outlier_price = price;
        options.strategy = strategy;
        const Built one(input.points, options);
        laws::check_hierarchy(one.sink, one.result, input.points, 64, kIdentityMap);
        options.threads = 3;
        const Built three(input.points, options);
        EXPECT_EQ(three.sink.levels, one.sink.levels);
        EXPECT_EQ(three.outliers, one.outliers);
        // Representatives cannot be outliers.
        if (one.sink.levels.empty()) continue;
        for (const std::uint64_t id : one.representatives(0)) {
          EXPECT_FALSE(one.outliers.contains(id));
        }
      }
    }
  }
}

// assign_outliers() must lower the cost, and the points that it keeps must be no farther than the
// price.
TEST(HierarchyOutliers, LeavingOutLowersTheCost) {
  std::mt19937_64 random(72);
  std::size_t left_out = 0;
  for (int round = 0; round < 60; ++round) {
    laws::OwnedProblem p;
    p.points = inputs::cube(400, random);
    const int far = round % 5;
    for (int i = 0; i < far; ++i) {
      p.points[static_cast<std::size_t>(97 * i)] = {3.0 + i, 5.0 * inputs::uniform(random), -4.0};
    }
    if (round % 3 == 0) p.metric = Elliptical(2.0, 0.5, 30.0);
    p.facility_cost = 0.2 + inputs::uniform(random);
    p.outlier_price = std::exp(-4.0 * inputs::uniform(random));
    SCOPED_TRACE("round " + std::to_string(round));
    BlockClusterer clusterer;
    BlockClustering clustering;
    run_linear(clusterer, p.view(), {.effort = Effort::standard, .seed = 1}, clustering);
    BlockClustering trimmed = clustering;
    assign_outliers(p.view(), trimmed);
    EXPECT_EQ(trimmed.facilities, clustering.facilities);

    const double unit = diagonal(p.metric, base::box_of(p.points));
    // A cluster whose members are all left out or elsewhere costs nothing.
    std::vector<char> used(trimmed.facilities.size(), 0);
    for (const std::uint32_t c : trimmed.assignment) {
      if (c != kOutlier) used[c] = 1;
    }
    EXPECT_GT(std::count(used.begin(), used.end(), 1), 0);
    double before = 0.0, after = 0.0;
    before += p.facility_cost * unit * static_cast<double>(clustering.facilities.size());
    after += p.facility_cost * unit * static_cast<double>(std::count(used.begin(), used.end(), 1));
    for (std::size_t i = 0; i < p.points.size(); ++i) {
      const auto to = [&](std::uint32_t c) {
        return distance(p.metric, p.points[trimmed.facilities[c]], p.points[i]);
      };
      const double price = p.outlier_price * unit;
      const std::uint32_t c = trimmed.assignment[i];
      before += std::min(price, to(clustering.assignment[i]));
      after += c == kOutlier ? price : to(c);
      if (c == kOutlier) {
        ++left_out;
      } else {
        EXPECT_LE(to(c), price * (1 + 1e-9));
      }
    }
    EXPECT_LE(after, before * (1 + 1e-9));
  }
  EXPECT_GT(left_out, 100u);
}

// The cost must be close to that of the local search that uses the price throughout.
TEST(HierarchyOutliers, CostIsCloseToTheSearchWithThePrice) {
  std::mt19937_64 random(73);
  for (const double price : {0.02, 0.05, 0.1}) {
    SCOPED_TRACE("price " + std::to_string(price));
    std::vector<Point3> points = inputs::scan(2, 40, random);
    for (std::size_t i = 0; i < points.size(); i += 250) points[i][2] += 3.0;
    points.push_back(points.front());
    HierarchyOptions options;
    options.block_size = points.size() - 1;
    options.block.facility_cost = 1.0;
    options.outlier_price = price;
    options.block.effort = Effort::fine;
    const auto cost = [&](const Built& built) {
      const RecordedBlock& block = built.sink.levels[0][0];
      // Both costs are in the same unit.
      const double unit = 10.0;
      double sum =
          unit * options.block.facility_cost * static_cast<double>(block.representatives.size());
      for (std::size_t c = 0; c < block.representatives.size(); ++c) {
        for (const std::uint32_t i : block.members(c)) {
          sum += std::min(
              unit * price,
              distance(Euclidean{}, block.positions[block.representatives[c]], block.positions[i]));
        }
      }
      return sum;
    };
    const Built fast(points, options);
    options.strategy = FacilityStrategy::full_scan;
    const Built search(points, options);
    EXPECT_LT(cost(fast), 1.25 * cost(search));
    EXPECT_GE(fast.outliers.size(), 9u);
    EXPECT_GE(search.outliers.size(), 9u);
  }
}

// The searches must find the same solution, whatever strategy computes the gains (7.3.2).
TEST(HierarchyStrategy, SearchesOfTheThesisGiveOneHierarchy) {
  std::mt19937_64 random(74);
  const std::vector<Point3> points = inputs::cube(1500, random);
  HierarchyOptions options;
  options.block_size = 300;
  options.block.facility_cost = 0.5;
  const Built fast(points, options);
  options.strategy = FacilityStrategy::full_scan;
  const Built scan(points, options);
  EXPECT_NE(scan.sink.levels, fast.sink.levels);
  for (const FacilityStrategy strategy : searches()) {
    if (strategy == FacilityStrategy::automatic) continue;
    SCOPED_TRACE(name_of(strategy));
    options.strategy = strategy;
    const Built built(points, options);
    EXPECT_EQ(built.sink.levels, scan.sink.levels);
    EXPECT_EQ(built.sink.top, scan.sink.top);
  }
}

TEST(HierarchyStrategy, RejectsStrategiesThatABlockDoesNotAdmit) {
  std::mt19937_64 random(75);
  const std::vector<Point3> points = inputs::cube(200, random);
  const auto message = [&](HierarchyOptions options) -> std::string {
    options.block_size = 50;
    try {
      const Built built(points, options);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  HierarchyOptions options;
  options.strategy = FacilityStrategy::kd_tree;
  options.metric =
      CustomMetric{[](const Point3& a, const Point3& b) { return distance(Euclidean{}, a, b); }};
  EXPECT_NE(message(options).find("kd-tree"), std::string::npos);
  options = {};
  options.outlier_price = 0.0;
  EXPECT_NE(message(options).find("outlier_price"), std::string::npos);
  options.outlier_price = std::nan("");
  EXPECT_NE(message(options).find("outlier_price"), std::string::npos);
}

}  // namespace
}  // namespace terrace::cluster
