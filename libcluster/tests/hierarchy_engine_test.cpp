// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <limits>
#include <mutex>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "hierarchy/engine.hpp"
#include "hierarchy_laws.hpp"
#include "inputs.hpp"
#include "recording_sink.hpp"
#include "waiting_threads.hpp"

/// How blocks are cut, clustered, committed and abandoned, with stand-ins for the clustering.

namespace terrace::cluster {
namespace {

using inputs::kInfinity;
using inputs::kNaN;

/// Makes clusters of ten consecutive points. The first of each is the facility.
void runs_of_ten(std::span<const Point3> points, std::span<const double>, const BlockOptions&,
                 BlockClustering& result) {
  result.facilities.clear();
  result.assignment.resize(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (i % 10 == 0) result.facilities.push_back(i);
    result.assignment[i] = i / 10;
  }
}

void each_point_alone(std::span<const Point3> points, std::span<const double>, const BlockOptions&,
                      BlockClustering& result) {
  result.facilities.resize(points.size());
  std::iota(result.facilities.begin(), result.facilities.end(), 0u);
  result.assignment = result.facilities;
}

std::vector<Point3> line(std::size_t n) {
  std::vector<Point3> points(n);
  for (std::size_t i = 0; i < n; ++i) points[i] = {static_cast<double>(i), 0.5, -1.0};
  return points;
}

HierarchyOptions small_blocks(unsigned threads = 1) {
  HierarchyOptions options;
  options.block_size = 100;
  options.payload_size = sizeof(std::uint64_t);
  options.threads = threads;
  return options;
}

void push_all(HierarchyEngine& engine, const std::vector<Point3>& points, std::size_t batch) {
  for (std::size_t i = 0; i < points.size(); i += batch) {
    const std::size_t end = std::min(i + batch, points.size());
    engine.push(std::span(points).subspan(i, end - i), numbered_payload(i, end));
  }
}

std::vector<std::size_t> block_sizes(const RecordingSink& sink, unsigned level) {
  std::vector<std::size_t> sizes;
  for (const RecordedBlock& block : sink.levels[level]) sizes.push_back(block.positions.size());
  return sizes;
}

using Sizes = std::vector<std::size_t>;

TEST(HierarchyEngine, BatchThatFitsABlockIsNotSplit) {
  RecordingSink sink;
  HierarchyEngine engine(small_blocks(), sink, [] { return runs_of_ten; });
  const std::vector<Point3> points = line(260);
  std::size_t at = 0;
  for (const std::size_t n : {40u, 60u, 30u, 0u, 80u, 20u, 1u, 29u}) {
    engine.push(std::span(points).subspan(at, n), numbered_payload(at, at + n));
    at += n;
  }
  const HierarchyResult result = engine.finish();
  EXPECT_EQ(block_sizes(sink, 0), (Sizes{100, 30, 100, 30}));
  laws::check_hierarchy(sink, result, points, 100);
}

TEST(HierarchyEngine, LargeBatchFillsTheCurrentBlock) {
  RecordingSink sink;
  HierarchyEngine engine(small_blocks(), sink, [] { return runs_of_ten; });
  const std::vector<Point3> points = line(471);
  engine.push(std::span(points).first(70), numbered_payload(0, 70));
  engine.push(std::span(points).subspan(70, 301), numbered_payload(70, 371));
  engine.push(std::span(points).subspan(371), numbered_payload(371, 471));
  const HierarchyResult result = engine.finish();
  EXPECT_EQ(block_sizes(sink, 0), (Sizes{100, 100, 100, 71, 100}));
  laws::check_hierarchy(sink, result, points, 100);
}

TEST(HierarchyEngine, FullBlockAtTheEndIsTheRoot) {
  RecordingSink sink;
  HierarchyEngine engine(small_blocks(), sink, [] { return runs_of_ten; });
  push_all(engine, line(100), 50);
  EXPECT_EQ(engine.finish().top, 0u);
  EXPECT_TRUE(sink.levels.empty());
  EXPECT_EQ(sink.top.positions.size(), 100u);
}

TEST(HierarchyEngine, ClusteringThatKeepsAllPointsStillEnds) {
  for (const std::size_t n : {101u, 5000u}) {
    for (const std::size_t block_size : {2u, 3u, 4u, 5u, 100u}) {
      SCOPED_TRACE(std::to_string(n) + " points, blocks of " + std::to_string(block_size));
      std::vector<double> costs;
      const auto cluster = [&](std::span<const Point3> points, std::span<const double> weights,
                               const BlockOptions& options, BlockClustering& result) {
        costs.push_back(options.facility_cost);
        each_point_alone(points, weights, options, result);
      };
      HierarchyOptions options = small_blocks();
      options.block_size = block_size;
      RecordingSink sink;
      HierarchyEngine engine(options, sink, [&] { return cluster; });
      push_all(engine, line(n), 2);
      const HierarchyResult result = engine.finish();
      laws::check_hierarchy(sink, result, line(n), block_size);
      // The block is retried with ever higher costs, beyond any sum of distances in it.
      EXPECT_EQ(costs[0], 1.0);
      EXPECT_EQ(costs[1], 4.0);
      EXPECT_GT(*std::max_element(costs.begin(), costs.end()), 0x1p24);
    }
  }
}

TEST(HierarchyEngine, WeightsAreCountsWithMeanOne) {
  struct Call {
    std::size_t points;
    std::vector<double> weights;
  };
  std::vector<Call> calls;
  const auto cluster = [&](std::span<const Point3> points, std::span<const double> weights,
                           const BlockOptions& options, BlockClustering& result) {
    calls.push_back({points.size(), {weights.begin(), weights.end()}});
    runs_of_ten(points, weights, options, result);
  };
  RecordingSink sink;
  HierarchyEngine engine(small_blocks(), sink, [&] { return cluster; });
  push_all(engine, line(20003), 77);  // at the ends of blocks, clusters have fewer than ten points
  const HierarchyResult result = engine.finish();
  ASSERT_EQ(result.top, 3u);

  std::size_t weighted = 0;
  for (const Call& call : calls) {
    if (call.weights.empty()) continue;
    ++weighted;
    ASSERT_EQ(call.weights.size(), call.points);
    double sum = 0.0;
    for (const double w : call.weights) sum += w;
    EXPECT_NEAR(sum / static_cast<double>(call.points), 1.0, 1e-12);
  }
  EXPECT_EQ(weighted, sink.levels[1].size() + sink.levels[2].size());
  // With one thread, the first call with weights is for the first block of level 1.
  const auto call =
      std::find_if(calls.begin(), calls.end(), [](const Call& c) { return !c.weights.empty(); });
  const RecordedBlock& block = sink.levels[1][0];
  for (std::size_t i = 0; i < block.positions.size(); ++i) {
    const std::uint64_t head = block.children[i];
    std::uint64_t count = 0;
    std::uint64_t ordinal = 0;
    for (const RecordedBlock& below : sink.levels[0]) {
      if (head < ordinal + below.summaries.size()) {
        count = below.members(head - ordinal).size();
        break;
      }
      ordinal += below.summaries.size();
    }
    EXPECT_DOUBLE_EQ(
        call->weights[i] / call->weights[0],
        static_cast<double>(count) / static_cast<double>(sink.levels[0][0].members(0).size()));
  }
}

TEST(HierarchyEngine, EachBlockHasItsOwnSeed) {
  std::vector<std::uint64_t> seeds;
  const auto cluster = [&](std::span<const Point3> points, std::span<const double> weights,
                           const BlockOptions& options, BlockClustering& result) {
    seeds.push_back(options.seed);
    runs_of_ten(points, weights, options, result);
  };
  RecordingSink sink;
  HierarchyOptions options = small_blocks();
  options.block.seed = 42;
  HierarchyEngine engine(options, sink, [&] { return cluster; });
  push_all(engine, line(5000), 100);
  engine.finish();
  EXPECT_EQ(seeds[0], block_seed(42, 0, 0));
  EXPECT_EQ(seeds[1], block_seed(42, 0, 1));
  std::sort(seeds.begin(), seeds.end());
  EXPECT_EQ(std::adjacent_find(seeds.begin(), seeds.end()), seeds.end());
}

TEST(HierarchyEngine, ClusteringSeesGroundPositions) {
  std::vector<Box3> boxes;
  std::vector<std::vector<Point3>> positions;
  const auto cluster = [&](std::span<const Point3> points, std::span<const double> weights,
                           const BlockOptions& options, BlockClustering& result) {
    positions.emplace_back(points.begin(), points.end());
    runs_of_ten(points, weights, options, result);
  };
  HierarchyOptions options = small_blocks();
  options.ground = [&](const Box3& box) {
    boxes.push_back(box);
    return GroundMap{2, 0, 0, 0, 3, 1, 0, 0, box.max[0]};
  };
  RecordingSink sink;
  HierarchyEngine engine(options, sink, [&] { return cluster; });
  push_all(engine, line(150), 50);
  engine.finish();
  ASSERT_EQ(positions.size(), 2u);
  EXPECT_EQ(boxes[0], (Box3{{0, 0.5, -1}, {99, 0.5, -1}}));
  EXPECT_EQ(boxes[1], (Box3{{100, 0.5, -1}, {149, 0.5, -1}}));
  EXPECT_EQ(positions[0][7], (Point3{14, 0, 0}));
  EXPECT_EQ(positions[1][7], (Point3{14, 0, 0}))
      << "positions must be relative to the minimum of the block";
}

// If maps differ between blocks, the error is the smaller of two bounds, each of which is valid for
// all descendants: the sum of legs, and the direct distance by the block's own map.
TEST(HierarchyEngine, ErrorHoldsWhereMapsDiffer) {
  std::mt19937_64 random(12);
  std::vector<Point3> points(5000);
  for (Point3& p : points) {
    for (double& x : p) x = static_cast<double>(random() >> 11) * 0x1p-53;
  }
  std::sort(points.begin(), points.end());
  const auto map_of = [](const Box3& box) {
    const double scale = 1.0 + box.min[0];
    return GroundMap{scale, 0, 0, 0, 1 / scale, 0, 0, 0, 1};
  };
  HierarchyOptions options = small_blocks();
  options.ground = map_of;
  RecordingSink sink;
  HierarchyEngine engine(options, sink, [] { return runs_of_ten; });
  push_all(engine, points, 100);
  const HierarchyResult result = engine.finish();
  ASSERT_GE(result.top, 2u);

  struct Descendant {
    Point3 position;
    long double path;  // length of the path from the head along the representatives
  };
  std::vector<std::vector<Descendant>> below;
  for (const auto& level : sink.levels) {
    std::vector<std::vector<Descendant>> clusters;
    std::size_t number = 0;
    for (const RecordedBlock& block : level) {
      Box3 box{block.positions[0], block.positions[0]};
      for (const Point3& p : block.positions) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          box.min[axis] = std::min(box.min[axis], p[axis]);
          box.max[axis] = std::max(box.max[axis], p[axis]);
        }
      }
      const GroundMap map = map_of(box);
      for (std::size_t c = 0; c < block.representatives.size(); ++c) {
        const Point3& from = block.positions[block.representatives[c]];
        std::vector<Descendant> all;
        for (const std::uint32_t i : block.members(c)) {
          const long double leg = laws::ground_distance(map, from, block.positions[i]);
          if (block.level == 0) {
            all.push_back({block.positions[i], leg});
          } else {
            for (const Descendant& d : below[number + i]) {
              all.push_back({d.position, leg + d.path});
            }
          }
        }
        long double path = 0.0L;
        long double direct = 0.0L;
        for (const Descendant& d : all) {
          path = std::max(path, d.path);
          direct = std::max(direct, laws::ground_distance(map, from, d.position));
        }
        EXPECT_GE(static_cast<long double>(block.summaries[c].error), std::min(path, direct));
        clusters.push_back(std::move(all));
      }
      number += block.positions.size();
    }
    below = std::move(clusters);
  }
}

TEST(HierarchyEngine, BadInputLeavesTheBuilderUnchanged) {
  const std::vector<Point3> points = line(330);
  for (const double bad : {kInfinity, -kInfinity, kNaN}) {
    for (const std::size_t location : {0u, 1u, 5u, 128u, 229u}) {
      RecordingSink sink;
      HierarchyEngine engine(small_blocks(), sink, [] { return runs_of_ten; });
      engine.push(std::span(points).first(100), numbered_payload(0, 100));
      std::vector<Point3> broken(points.begin() + 100, points.end());
      broken[location][location % 3] = bad;
      try {
        engine.push(broken, numbered_payload(100, 330));
        ADD_FAILURE() << "accepted";
      } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find("point " + std::to_string(location) + " "),
                  std::string::npos)
            << error.what();
      }
      EXPECT_THROW(engine.push(broken, {}), std::invalid_argument);
      engine.push(std::span(points).subspan(100), numbered_payload(100, 330));
      const HierarchyResult result = engine.finish();
      laws::check_hierarchy(sink, result, points, 100);
    }
  }
}

TEST(HierarchyEngine, RejectsOptionsOutOfRange) {
  RecordingSink sink;
  const auto make = [] { return runs_of_ten; };
  HierarchyOptions options;
  options.block_size = 1;
  EXPECT_THROW(HierarchyEngine(options, sink, make), std::invalid_argument);
  options.block_size = std::size_t{1} << 24;
  EXPECT_THROW(HierarchyEngine(options, sink, make), std::invalid_argument);
  for (const double cost : {0.0, -1.0, std::numeric_limits<double>::infinity(),
                            std::numeric_limits<double>::quiet_NaN()}) {
    options = {};
    options.block.facility_cost = cost;
    EXPECT_THROW(HierarchyEngine(options, sink, make), std::invalid_argument);
  }
}

// ---- Failures -----------------------------------------------------------------------------------

struct Failure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

enum class Location { prepare, commit, root, ground, cluster };

/// Throws at the n-th visit to one place.
struct Trap {
  Location location;
  int remaining_visits;
  std::mutex mutex;

  void visit(Location place) {
    const std::lock_guard lock(mutex);
    if (place == location && remaining_visits-- == 0) throw Failure("trap");
  }
};

class TrappedSink : public RecordingSink {
 public:
  explicit TrappedSink(Trap& trap) : trap_(trap) {}
  std::unique_ptr<Prepared> prepare(const ClusteredBlock& block) override {
    trap_.visit(Location::prepare);
    return RecordingSink::prepare(block);
  }
  void commit(unsigned level, std::unique_ptr<Prepared> prepared) override {
    trap_.visit(Location::commit);
    RecordingSink::commit(level, std::move(prepared));
  }
  void root(const ClusteredBlock& block) override {
    trap_.visit(Location::root);
    RecordingSink::root(block);
  }

 private:
  Trap& trap_;
};

TEST(HierarchyEngine, ExceptionsAreRethrownOnce) {
  for (const Location location :
       {Location::prepare, Location::commit, Location::root, Location::ground, Location::cluster}) {
    for (const int visit : {0, 1, 20, 55}) {
      for (const unsigned threads : {1u, 2u, 3u, 8u}) {
        if (location == Location::root && visit > 0) continue;
        SCOPED_TRACE(testing::Message() << "place " << static_cast<int>(location) << ", visit "
                                        << visit << ", threads " << threads);
        Trap trap{location, visit, {}};
        TrappedSink sink(trap);
        HierarchyOptions options = small_blocks(threads);
        options.ground = [&](const Box3&) {
          trap.visit(Location::ground);
          return GroundMap{2, 0, 0, 0, 1, 0, 0, 0, 1};
        };
        const auto cluster = [&](std::span<const Point3> points, std::span<const double> weights,
                                 const BlockOptions& block_options, BlockClustering& result) {
          trap.visit(Location::cluster);
          runs_of_ten(points, weights, block_options, result);
        };
        HierarchyEngine engine(options, sink, [&] { return cluster; });
        const auto build = [&] {
          push_all(engine, line(5001), 50);  // 51 + 6 blocks
          engine.finish();
        };
        EXPECT_THROW(build(), Failure);
        const int calls = sink.calls;
        std::this_thread::yield();
        EXPECT_THROW(engine.push(line(1), numbered_payload(0, 1)), std::logic_error);
        EXPECT_THROW(engine.finish(), std::logic_error);
        EXPECT_EQ(sink.calls, calls) << "the sink was called after the failure";
        EXPECT_FALSE(sink.has_root);
      }
    }
  }
}

/// Its first block fails while another thread than the caller's prepares a second one. That thread
/// lingers until all other threads wait for it, or the failure has been thrown.
class LingeringSink : public RecordingSink {
 public:
  std::unique_ptr<Prepared> prepare(const ClusteredBlock& block) override {
    if (block.block == 0) {
      while (!lingers) std::this_thread::yield();
      failed = true;
      throw Failure("first block");
    }
    ++inside;
    const bool first = std::this_thread::get_id() != caller && !lingers.exchange(true);
    while (!failed) std::this_thread::yield();
    if (first) wait_until_others_wait([this] { return come_out.load(); });
    --inside;
    return RecordingSink::prepare(block);
  }
  std::thread::id caller = std::this_thread::get_id();
  std::atomic<int> inside = 0;
  std::atomic<bool> lingers = false, failed = false, come_out = false;
};

TEST(HierarchyEngine, RethrowsOnlyWhenNoCallToTheSinkIsRunning) {
  LingeringSink sink;
  HierarchyEngine engine(small_blocks(3), sink, [] { return runs_of_ten; });
  const auto build = [&] {
    push_all(engine, line(301), 50);
    engine.finish();
  };
  EXPECT_THROW(build(), Failure);
  EXPECT_EQ(sink.inside, 0);
  sink.come_out = true;
}

TEST(HierarchyEngine, FinishMayBeCalledOnce) {
  RecordingSink sink;
  HierarchyEngine engine(small_blocks(), sink, [] { return runs_of_ten; });
  engine.finish();
  EXPECT_THROW(engine.finish(), std::logic_error);
  EXPECT_THROW(engine.push(line(1), numbered_payload(0, 1)), std::logic_error);
}

TEST(HierarchyEngine, RejectsInvalidGroundMaps) {
  const std::vector<GroundMap> maps = {{1, 0, 0, 0, kNaN, 0, 0, 0, 1},
                                       {1, 0, 0, 0, 1, 0, 0, kInfinity, 1},
                                       {0, 0, 0, 0, 0, 0, 0, 0, 0},
                                       {1e200, 0, 0, 0, 1, 0, 0, 0, 1}};
  for (const GroundMap& map : maps) {
    HierarchyOptions options = small_blocks();
    options.ground = [&](const Box3&) { return map; };
    RecordingSink sink;
    HierarchyEngine engine(options, sink, [] { return runs_of_ten; });
    EXPECT_THROW(push_all(engine, line(101), 50), std::invalid_argument);
  }
  RecordingSink sink;
  HierarchyEngine engine(small_blocks(), sink, [] { return runs_of_ten; });
  std::vector<Point3> points = line(101);
  points[0][0] = -std::numeric_limits<double>::max();
  points[1][0] = std::numeric_limits<double>::max();
  EXPECT_THROW(push_all(engine, points, 50), std::invalid_argument);
}

TEST(HierarchyEngine, DestructorStopsQuietly) {
  for (const unsigned threads : {1u, 2u, 3u, 8u}) {
    for (const std::size_t n : {0u, 100u, 101u, 999u, 10000u}) {
      RecordingSink sink;
      {
        HierarchyEngine engine(small_blocks(threads), sink, [] { return runs_of_ten; });
        push_all(engine, line(n), 33);
      }
      const int calls = sink.calls;
      std::this_thread::yield();
      EXPECT_EQ(sink.calls, calls);
      EXPECT_FALSE(sink.has_root);
    }
  }
  // The same with an additional failure.
  Trap trap{Location::commit, 3, {}};
  TrappedSink sink(trap);
  HierarchyEngine engine(small_blocks(2), sink, [] { return runs_of_ten; });
  push_all(engine, line(550), 50);
}

/// Its first block is prepared only when all other threads wait for it.
class SlowStartSink : public RecordingSink {
 public:
  std::unique_ptr<Prepared> prepare(const ClusteredBlock& block) override {
    if (block.level == 0) {
      if (block.block == 0) wait_until_others_wait();
      const int waiting = ++waiting_;
      int most = max_waiting;
      while (most < waiting && !max_waiting.compare_exchange_weak(most, waiting)) {
      }
    }
    return RecordingSink::prepare(block);
  }
  void commit(unsigned level, std::unique_ptr<Prepared> prepared) override {
    if (level == 0) --waiting_;
    RecordingSink::commit(level, std::move(prepared));
  }
  std::atomic<int> max_waiting = 0;

 private:
  std::atomic<int> waiting_ = 0;
};

TEST(HierarchyEngine, FewBlocksPerThreadAreInProgress) {
  for (const unsigned threads : {1u, 2u, 4u}) {
    SlowStartSink sink;
    HierarchyEngine engine(small_blocks(threads), sink, [] { return runs_of_ten; });
    const std::vector<Point3> points = line(20000);
    push_all(engine, points, 50);
    laws::check_hierarchy(sink, engine.finish(), points, 100);
    EXPECT_LE(sink.max_waiting, static_cast<int>(4 * threads + 1));
  }
}

}  // namespace
}  // namespace terrace::cluster
