// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/store_query.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "store_testing.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

using testing::uniform;

/// A store and all its points with their levels, for comparison by brute force.
class QueriedStore {
 public:
  QueriedStore(const StoreSchema& schema, const std::vector<testing::PushedBlock>& blocks,
               const testing::StandInHierarchy::Options& options) {
    testing::write_store(folder_->path() / "s", schema, blocks, options);
    store_ = std::make_unique<Store>(Store::open(folder_->path() / "s"));
    for (unsigned level = 0; level <= store_->top(); ++level) {
      store_->for_each(level, [&](ClusterId id, const ClusterRecord&, const ClusterPoints& points) {
        for (std::size_t i = 0; i < points.size(); ++i) {
          points_.push_back({.position = points.positions[i],
                             .cluster = id,
                             .member = static_cast<std::uint32_t>(i)});
        }
      });
    }
  }

  [[nodiscard]] const Store& store() const { return *store_; }
  [[nodiscard]] const std::vector<FoundPoint>& points() const { return points_; }

 private:
  std::unique_ptr<TempFolder> folder_ = std::make_unique<TempFolder>();
  std::unique_ptr<Store> store_;
  std::vector<FoundPoint> points_;
};

/// The points of a small box are found without reading the index of distant clusters.
TEST(StoreQuery, ReadsOnlyTheNearbyPartOfTheIndex) {
  const TempFolder folder;
  testing::write_store(
      folder.path() / "s", testing::grid_schema(ScalarType::i16),
      testing::grid_blocks(ScalarType::i16, testing::ReliefKind::fractal, 600, 600, 30, 1),
      {.block_points = 900, .cluster_points = 10});
  std::uint64_t read = 0;
  const Store store = Store::open("s", [&](const std::string& name) {
    const std::shared_ptr<ByteSource> file = open_file(folder.path() / "s" / name);
    const bool counted = name == "level-0.0.index";
    return bytes_by_function(
        name, file->size(), [file, counted, &read](std::uint64_t offset, std::span<std::byte> out) {
          file->read(offset, out);
          if (counted) read += out.size();
        });
  });
  const std::uint64_t index = store.levels()[0].index_bytes;
  ASSERT_GT(store.levels()[0].clusters, 30000u);
  read = 0;
  StoreQuery query(store);
  const Box3 box{{300, 200, -1e9}, {304, 204, 1e9}};
  const std::size_t inside = query.in_box(box).size();  // some cells have no data
  EXPECT_GT(inside, 10u);
  EXPECT_EQ(query.count(box), inside);
  EXPECT_EQ(query.nearest({100, 100, store.mean_height()}, 1).size(), 1u);
  EXPECT_GT(read, 0u);
  EXPECT_LT(read, index / 20);
}

/// In an index of many chapters, only the contents of nearby chapters are read, and once.
TEST(StoreQuery, ReadsOnlyTheContentsOfNearbyChapters) {
  const TempFolder folder;
  const std::vector<testing::PushedBlock> blocks =
      testing::grid_blocks(ScalarType::i16, testing::ReliefKind::fractal, 1200, 1200, 30, 1);
  testing::write_store(folder.path() / "s", testing::grid_schema(ScalarType::i16), blocks,
                       {.block_points = 900, .cluster_points = 6});
  std::uint64_t reads = 0, read = 0;
  const Store store = Store::open("s", [&](const std::string& name) {
    const std::shared_ptr<ByteSource> file = open_file(folder.path() / "s" / name);
    const bool counted = name == "level-0.0.index";
    return bytes_by_function(
        name, file->size(),
        [file, counted, &read, &reads](std::uint64_t offset, std::span<std::byte> out) {
          file->read(offset, out);
          if (!counted) return;
          read += out.size();
          ++reads;
        });
  });
  // The directory is small, and nothing else has been read.
  ASSERT_GT(store.levels()[0].clusters, 150000u);
  EXPECT_EQ(reads, 1u);
  EXPECT_LT(read, 10000u);
  StoreQuery query(store);
  const Box3 box{{300, 200, -1e9}, {304, 204, 1e9}};
  std::size_t inside = 0;
  for (const testing::PushedBlock& block : blocks) {
    for (const Point3& p : block.positions) inside += box.contains(p) ? 1 : 0;
  }
  EXPECT_EQ(query.in_box(box).size(), inside);
  EXPECT_LT(read, store.levels()[0].index_bytes / 20);
  const std::uint64_t before = reads;
  EXPECT_EQ(query.in_box(box).size(), inside);
  EXPECT_EQ(reads, before);
  EXPECT_EQ(query.count({{-1, -1, -1e9}, {5000, 5000, 1e9}}), store.points());
  EXPECT_TRUE(store.verify(testing::fail_on_problem));
}

constexpr double kFarAway = std::numeric_limits<double>::infinity();

using Key = std::tuple<double, Point3, ClusterId, std::uint32_t>;

Key key_of(const FoundPoint& point) {
  return {point.distance, point.position, point.cluster, point.member};
}

std::vector<Key> keys_of(std::vector<FoundPoint> points, bool sorted) {
  std::vector<Key> keys;
  for (const FoundPoint& point : points) keys.push_back(key_of(point));
  if (!sorted) std::sort(keys.begin(), keys.end());
  return keys;
}

/// Returns distances as long doubles, which do not overflow here.
double distance_between(const LinearMap& map, const Point3& a, const Point3& b) {
  long double square = 0;
  for (std::size_t row = 0; row < 3; ++row) {
    long double c = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      c += static_cast<long double>(map[3 * row + axis]) *
           (static_cast<long double>(a[axis]) - static_cast<long double>(b[axis]));
    }
    square += c * c;
  }
  return static_cast<double>(std::sqrt(square));
}

std::vector<QueriedStore> stores_of_all_kinds() {
  std::vector<QueriedStore> stores;
  for (const auto kind : {testing::CoordinateKind::decimals, testing::CoordinateKind::doubles,
                          testing::CoordinateKind::extremes, testing::CoordinateKind::mixed}) {
    stores.emplace_back(
        testing::cloud_schema(), testing::cloud_blocks(kind, 4000, 500, 11),
        testing::StandInHierarchy::Options{.block_points = 500, .cluster_points = 40});
  }
  stores.emplace_back(
      testing::grid_schema(ScalarType::i16),
      testing::grid_blocks(ScalarType::i16, testing::ReliefKind::fractal, 70, 60, 20, 12),
      testing::StandInHierarchy::Options{.block_points = 400, .cluster_points = 40});
  // One block, so that the root has all points; and an empty store.
  stores.emplace_back(testing::cloud_schema(),
                      testing::cloud_blocks(testing::CoordinateKind::decimals, 30, 500, 13),
                      testing::StandInHierarchy::Options{});
  stores.emplace_back(testing::cloud_schema(), std::vector<testing::PushedBlock>{},
                      testing::StandInHierarchy::Options{});
  return stores;
}

/// Returns boxes of all sizes, around points and anywhere, including flat and inverted ones.
Box3 random_box(std::mt19937_64& random, const QueriedStore& queried) {
  const auto& points = queried.points();
  const auto corner = [&]() -> Point3 {
    if (!points.empty() && random() % 4 != 0) return points[random() % points.size()].position;
    return {300 * uniform(random) - 50, 300 * uniform(random) - 50, 200 * uniform(random)};
  };
  Box3 box;
  box.include(corner());
  if (random() % 8 != 0) box.include(corner());
  if (random() % 4 == 0) {
    box.min[2] = -std::numeric_limits<double>::infinity();
    box.max[2] = std::numeric_limits<double>::infinity();
  }
  if (random() % 16 == 0) std::swap(box.min, box.max);
  return box;
}

TEST(StoreQuery, RangesAndCountsAreThoseOfBruteForce) {
  for (const QueriedStore& queried : stores_of_all_kinds()) {
    StoreQuery query(queried.store(), 1 << 16);
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
      SCOPED_TRACE(std::to_string(queried.points().size()) + " points, seed " +
                   std::to_string(seed));
      std::mt19937_64 random(seed);
      const Box3 box = random_box(random, queried);
      for (unsigned level = 0; level <= queried.store().top() + 1; ++level) {
        std::vector<FoundPoint> expected;
        for (const FoundPoint& point : queried.points()) {
          if (level_of(point.cluster) >= level && box.contains(point.position)) {
            expected.push_back(point);
          }
        }
        const auto result = query.in_box(box, level);
        EXPECT_TRUE(std::is_sorted(
            result.begin(), result.end(), [](const FoundPoint& a, const FoundPoint& b) {
              return level_of(a.cluster) > level_of(b.cluster) ||
                     (level_of(a.cluster) == level_of(b.cluster) && a.cluster < b.cluster);
            }));
        ASSERT_EQ(keys_of(result, false), keys_of(expected, false)) << "level " << level;
        if (level > 0) continue;
        ASSERT_EQ(query.count(box), expected.size());
        // Clusters on the border count in part, clusters inside count completely.
        EXPECT_LE(query.estimate(box), static_cast<double>(queried.points().size()) * (1 + 1e-9));
      }
    }
    const Box3 all{{-kFarAway, -kFarAway, -kFarAway}, {kFarAway, kFarAway, kFarAway}};
    EXPECT_EQ(query.count(all), queried.points().size());
    EXPECT_EQ(query.estimate(all), static_cast<double>(queried.points().size()));
    if (queried.points().size() > 100) {
      EXPECT_GT(query.estimate(all, 50), 50);
    }
  }
}

TEST(StoreQuery, NearestPointsAndRadiiAreThoseOfBruteForce) {
  for (const QueriedStore& queried : stores_of_all_kinds()) {
    StoreQuery query(queried.store(), 1 << 16);
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
      SCOPED_TRACE(std::to_string(queried.points().size()) + " points, seed " +
                   std::to_string(seed));
      std::mt19937_64 random(seed);
      LinearMap metric = kIdentityMap;
      if (seed % 3 == 0) metric = {1, 0, 0, 0, 1, 0, 0, 0, 0};
      if (seed % 3 == 1) {
        for (double& c : metric) c = 2 * uniform(random) - 1;
      }
      const Box3 box = random_box(random, queried);
      const Point3 place = std::isfinite(box.min[2]) ? box.min : Point3{box.min[0], box.min[1], 7};
      const auto level = static_cast<unsigned>(random() % (queried.store().top() + 1));
      std::vector<FoundPoint> expected;
      for (const FoundPoint& point : queried.points()) {
        if (level_of(point.cluster) < level) continue;
        expected.push_back(point);
      }
      // First all points: their distances are correct and in order.
      const auto all = query.nearest(place, expected.size() + 1, metric, level);
      ASSERT_EQ(all.size(), expected.size());
      for (const FoundPoint& point : all) {
        const double exact = distance_between(metric, point.position, place);
        double terms = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          terms += std::abs(point.position[axis]) + std::abs(place[axis]);
        }
        if (exact < 1e308 && terms < 1e308) {
          ASSERT_NEAR(point.distance, exact, 1e-14 * (exact + terms) + 1e-322);
        }
      }
      std::vector<Key> in_order = keys_of(all, true);
      EXPECT_TRUE(std::is_sorted(in_order.begin(), in_order.end()));
      // Fewer points, and those within a radius, are the first of these.
      for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{7},
                                      static_cast<std::size_t>(random() % 500)}) {
        std::vector<Key> first = in_order;
        first.resize(std::min(first.size(), count));
        ASSERT_EQ(keys_of(query.nearest(place, count, metric, level), true), first);
      }
      if (all.empty()) continue;
      const double radius = all[random() % all.size()].distance;
      if (!std::isfinite(radius)) continue;
      std::erase_if(in_order, [&](const Key& key) { return std::get<0>(key) > radius; });
      ASSERT_EQ(keys_of(query.within(place, radius, metric, level), true), in_order);
    }
  }
}

/// Returns a cloud whose points have the sum of their coordinates as an attribute.
QueriedStore store_of_sums() {
  StoreSchema schema = testing::cloud_schema();
  schema.attributes.push_back(testing::channel("sum"));
  auto blocks = testing::cloud_blocks(testing::CoordinateKind::decimals, 3000, 500, 3);
  for (auto& block : blocks) {
    for (const Point3& p : block.positions) {
      const double sum = p[0] + p[1] + p[2];
      const auto bytes = std::as_bytes(std::span(&sum, 1));
      block.payload.insert(block.payload.end(), bytes.begin(), bytes.end());
    }
  }
  return {schema, blocks, {.block_points = 500, .cluster_points = 40}};
}

TEST(StoreQuery, FoundPointsLeadToTheirAttributes) {
  const QueriedStore queried = store_of_sums();
  StoreQuery query(queried.store());
  ClusterPoints points;
  const std::vector<FoundPoint> nearest = query.nearest({50, 50, 50}, 100);
  const std::vector<std::byte> sums = query.attributes(nearest);
  ASSERT_EQ(sums.size(), nearest.size() * sizeof(double));
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    const FoundPoint& point = nearest[i];
    queried.store().read(point.cluster, points);
    EXPECT_EQ(points.positions[point.member], point.position);
    const double sum = point.position[0] + point.position[1] + point.position[2];
    EXPECT_EQ(queried.store().schema().view<double>(points.payload, 0)[point.member], sum);
    EXPECT_EQ(queried.store().schema().view<double>(sums, 0)[i], sum);
  }
}

TEST(StoreQuery, FindsOnlyPointsThatMeetTheCondition) {
  const QueriedStore queried = store_of_sums();
  std::vector<double> sums;
  for (const FoundPoint& point : queried.points()) {
    sums.push_back(point.position[0] + point.position[1] + point.position[2]);
  }
  std::sort(sums.begin(), sums.end());
  const unsigned seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937_64 random(seed);
  for (const double share : {0.0, 0.001, 0.5, 0.999, 1.0}) {
    const double threshold =
        sums[static_cast<std::size_t>(share * static_cast<double>(sums.size() - 1))];
    const Store view = queried.store().where("sum > " + std::to_string(threshold));
    StoreQuery query(view, 1 << 16);
    const auto meets = [&](const Point3& p) {
      return p[0] + p[1] + p[2] > std::stod(std::to_string(threshold));
    };
    for (int round = 0; round < 20; ++round) {
      const Box3 all = queried.store().bounds();
      Point3 place, other;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        place[axis] = all.min[axis] + uniform(random) * (all.max[axis] - all.min[axis]);
        other[axis] = all.min[axis] + uniform(random) * (all.max[axis] - all.min[axis]);
      }
      Box3 box;
      box.include(place);
      box.include(other);
      std::vector<FoundPoint> inside, near;
      for (const FoundPoint& point : queried.points()) {
        if (!meets(point.position)) continue;
        if (box.contains(point.position)) inside.push_back(point);
        const double x = point.position[0] - place[0], y = point.position[1] - place[1],
                     z = point.position[2] - place[2];
        near.push_back(point);
        near.back().distance = std::sqrt(x * x + y * y + z * z);
      }
      EXPECT_EQ(query.in_box(box).size(), inside.size());
      EXPECT_EQ(query.count(box), inside.size());
      for (unsigned level = 0; level <= view.top(); ++level) {
        const auto of_level = [level](const FoundPoint& p) { return level_of(p.cluster) >= level; };
        std::vector<FoundPoint> expected;
        std::copy_if(inside.begin(), inside.end(), std::back_inserter(expected), of_level);
        EXPECT_EQ(keys_of(query.in_box(box, level), false), keys_of(expected, false));
        EXPECT_EQ(query.count(box, level), expected.size());
      }
      std::sort(near.begin(), near.end(),
                [](const FoundPoint& a, const FoundPoint& b) { return key_of(a) < key_of(b); });
      near.resize(std::min<std::size_t>(near.size(), 7));
      const std::vector<FoundPoint> nearest = query.nearest(place, 7);
      ASSERT_EQ(nearest.size(), near.size());
      for (std::size_t i = 0; i < nearest.size(); ++i)
        EXPECT_EQ(key_of(nearest[i]), key_of(near[i]));
      if (near.empty()) continue;
      EXPECT_GE(query.within(place, near.back().distance).size(), near.size());
    }
  }
}

TEST(StoreView, CountsOnlyPointsThatMeetTheCondition) {
  const QueriedStore queried = store_of_sums();
  const Store& store = queried.store();
  for (const char* condition : {"sum > 150", "sum > 150 && sum < 150.5", "x > 40 && y < 20",
                                "sum == sum", "x + y + z == sum"}) {
    SCOPED_TRACE(condition);
    const Where where(condition, store.schema());
    const Store view = store.where(condition);
    ASSERT_NE(view.condition(), nullptr);
    EXPECT_EQ(view.condition()->text(), condition);
    EXPECT_EQ(view.whole().condition(), nullptr);
    EXPECT_EQ(view.whole().bounds(), store.bounds());
    Box3 bounds;
    std::size_t left_out = 0;
    for (unsigned level = 0; level <= store.top(); ++level) {
      // By all points of all clusters, without using their ranges.
      std::vector<std::pair<ClusterId, std::uint32_t>> expected, marked;
      std::size_t clusters = 0;
      store.for_each(level, [&](ClusterId id, const ClusterRecord&, const ClusterPoints& points) {
        std::vector<std::uint8_t> matches(points.size());
        where.test(points.positions, points.payload, matches);
        for (std::uint32_t i = 0; i < points.size(); ++i) {
          EXPECT_TRUE(points.match(i));
          if (matches[i] == 0) continue;
          expected.emplace_back(id, i);
          bounds.include(points.positions[i]);
        }
        ClusterPoints again;
        view.read(id, again);
        EXPECT_EQ(again.matches, matches);
        ++clusters;
      });
      view.for_each(level, [&](ClusterId id, const ClusterRecord&, const ClusterPoints& points) {
        for (std::uint32_t i = 0; i < points.size(); ++i) {
          if (points.match(i)) marked.emplace_back(id, i);
        }
        --clusters;
      });
      EXPECT_EQ(marked, expected) << "level " << level;
      EXPECT_TRUE(level == 0 || clusters == 0) << "level " << level;
      left_out += clusters;
    }
    EXPECT_EQ(view.bounds(), bounds);
    EXPECT_EQ(view.with_stop({}).bounds(), bounds);
    // The first condition is met everywhere, the second in few clusters.
    const std::string_view text = condition;
    EXPECT_EQ(text == "sum == sum" && left_out > 0, false);
    EXPECT_EQ(text == "sum > 150 && sum < 150.5" && left_out == 0, false);
  }
  // A view of a view, an empty condition, a condition that no point meets, and an invalid one.
  const Store both = store.where("sum > 150 || x < 5").where("y < 30 || z < 1");
  EXPECT_EQ(
      StoreQuery(both).count(store.bounds()),
      StoreQuery(store.where("(sum > 150 || x < 5) && (y < 30 || z < 1)")).count(store.bounds()));
  EXPECT_EQ(store.where("").condition(), nullptr);
  EXPECT_EQ(StoreQuery(store.where("sum < -1")).count(store.bounds()), 0U);
  try {
    static_cast<void>(store.where("sum < -1").bounds());
    FAIL() << "a view without points has bounds";
  } catch (const Error& error) {
    EXPECT_EQ(error.parts().cause.text(), "no point meets the condition 'sum < -1'");
  }
  EXPECT_THROW(static_cast<void>(store.where("sum <")), Error);
  std::stop_source stop;
  stop.request_stop();
  const Store stopped = store.with_stop(stop.get_token()).where("sum > 0");
  EXPECT_THROW(static_cast<void>(stopped.bounds()), Stopped);
}

TEST(StoreQuery, EndsWhenTheStoreIsStopped) {
  const QueriedStore queried(
      testing::cloud_schema(),
      testing::cloud_blocks(testing::CoordinateKind::decimals, 20000, 500, 5),
      {.block_points = 500, .cluster_points = 40});
  std::stop_source stop;
  const Store stopped = queried.store().with_stop(stop.get_token());
  StoreQuery query(stopped);
  EXPECT_EQ(query.nearest({50, 50, 50}, 3).size(), 3u);
  stop.request_stop();
  EXPECT_THROW(static_cast<void>(query.in_box({{0, 0, 0}, {300, 300, 100}})), Stopped);
}

}  // namespace
}  // namespace terrace::stream
