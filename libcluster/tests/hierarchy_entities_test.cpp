// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "hierarchy_laws.hpp"
#include "inputs.hpp"
#include "recording_sink.hpp"
#include "terrace/cluster/facility_location.hpp"
#include "terrace/cluster/hierarchy.hpp"

/// Entities of several corners in the stream (thesis chapter 9). The payload is the entity's
/// number, by which its corners are found.

namespace terrace::cluster {
namespace {

// Entities of k contiguous corners.
struct Entities {
  std::size_t k = 3;
  bool ordered = false;
  std::vector<Point3> corners;

  [[nodiscard]] std::size_t size() const { return corners.size() / k; }
  [[nodiscard]] std::span<const Point3> operator[](std::size_t i) const {
    return std::span(corners).subspan(i * k, k);
  }
  [[nodiscard]] std::vector<Point3> first_corners() const {
    std::vector<Point3> positions;
    for (std::size_t i = 0; i < size(); ++i) positions.push_back(corners[i * k]);
    return positions;
  }
  [[nodiscard]] PayloadCorners reader() const {
    return {k, ordered,
            [this](std::span<const std::byte> payload, std::span<Point3> corners_of_one) {
              std::uint64_t id = 0;
              std::memcpy(&id, payload.data(), sizeof id);
              const auto all = (*this)[id];
              EXPECT_EQ(corners_of_one[0], all[0]);
              std::copy(all.begin(), all.end(), corners_of_one.begin());
            }};
  }
  // Returns the library's public distance, on the ground.
  [[nodiscard]] double distance(std::size_t i, std::size_t j, const GroundMap& map) const {
    const auto ground = [&](std::size_t e) {
      std::vector<Point3> points((*this)[e].begin(), (*this)[e].end());
      for (Point3& p : points) {
        const Point3 q = p;
        for (std::size_t row = 0; row < 3; ++row) {
          p[row] = map[3 * row] * q[0] + map[3 * row + 1] * q[1] + map[3 * row + 2] * q[2];
        }
      }
      return points;
    };
    const std::vector<Point3> a = ground(i), b = ground(j);
    if (ordered) return polyline_distance(a, b);
    if (k == 2) return segment_distance({a[0], a[1]}, {b[0], b[1]});
    return triangle_distance({a[0], a[1], a[2]}, {b[0], b[1], b[2]});
  }
};

// Makes small entities on and off a lattice, a few of them equal or degenerate.
Entities soup(std::size_t n, std::size_t k, bool ordered, std::mt19937_64& random) {
  Entities entities{k, ordered, {}};
  for (std::size_t i = 0; i < n; ++i) {
    Point3 centre{};
    for (double& x : centre) x = inputs::uniform(random) * 100;
    const double size = random() % 8 == 0 ? 0.0 : random() % 2 == 0 ? 1.0 : 30.0;
    if (i % 3 == 0) {
      for (double& x : centre) x = std::floor(x / 20) * 20;
    }
    for (std::size_t c = 0; c < k; ++c) {
      Point3 p = centre;
      for (double& x : p) x += size * (inputs::uniform(random) - 0.5);
      entities.corners.push_back(p);
    }
  }
  return entities;
}

struct BuiltEntities {
  RecordingSink sink;
  HierarchyResult result;

  BuiltEntities(const Entities& entities, HierarchyOptions options) {
    // The number of an entity modulo 7 is its channel, if there is one.
    options.channels.read = [](std::span<const std::byte> payload, std::span<double> values) {
      std::uint64_t id = 0;
      std::memcpy(&id, payload.data(), sizeof id);
      values[0] = static_cast<double>(id % 7);
    };
    options.payload_size = sizeof(std::uint64_t);
    options.corners = entities.reader();
    HierarchyBuilder builder(std::move(options), sink);
    builder.push(entities.first_corners(), numbered_payload(0, entities.size()));
    result = builder.finish();
  }
};

// The hierarchy's guarantees must hold, every entity must be with the nearest representative by the
// public distance, and any number of threads must give the same hierarchy.
TEST(HierarchyEntities, AreWithTheNearestRepresentative) {
  const GroundMap oblong{2, 0, 0, 0, 0.5, 0, 0, 0, 3};
  int run = 0;
  for (const auto& [k, ordered] : {std::pair<std::size_t, bool>{2, false}, {3, false}, {5, true}}) {
    for (const GroundMap& map : {GroundMap{1, 0, 0, 0, 1, 0, 0, 0, 1}, oblong}) {
      SCOPED_TRACE(testing::Message() << k << " corners, run " << run);
      std::mt19937_64 random(static_cast<std::uint64_t>(40 + run++));
      const Entities entities = soup(2100, k, ordered, random);
      HierarchyOptions options;
      options.block_size = 500;
      options.block.facility_cost = 0.3;
      options.ground = [&](const Box3&) { return map; };
      const double weight = run % 2 == 0 ? 4.0 : 0.0;
      if (weight > 0.0) options.channels.weights = {weight};
      const auto distance = [&](std::size_t i, std::size_t j) {
        const double channel = weight * (static_cast<double>(i % 7) - static_cast<double>(j % 7));
        return std::hypot(entities.distance(i, j, map), channel);
      };
      const BuiltEntities built(entities, options);
      ASSERT_GE(built.result.top, 1u);
      laws::check_hierarchy(built.sink, built.result, entities.first_corners(), options.block_size,
                            map);
      for (const std::vector<RecordedBlock>& level : built.sink.levels) {
        for (const RecordedBlock& block : level) {
          for (std::size_t c = 0; c < block.representatives.size(); ++c) {
            for (const std::uint32_t i : block.members(c)) {
              const double own = distance(block.id(i), block.id(block.representatives[c]));
              for (const std::uint32_t other : block.representatives) {
                ASSERT_LE(own, distance(block.id(i), block.id(other)) + 1e-9);
              }
            }
          }
        }
      }
      options.threads = 3;
      const BuiltEntities parallel(entities, options);
      EXPECT_EQ(parallel.sink.levels, built.sink.levels);
      EXPECT_EQ(parallel.sink.top, built.sink.top);
    }
  }
}

// Triangles around one place differ in size and direction, whichever corner comes first.
TEST(HierarchyEntities, ClusterByAllCorners) {
  std::mt19937_64 random(3);
  Entities entities;
  for (std::size_t i = 0; i < 601; ++i) {
    const double side = i % 3 == 0 ? 1.0 : i % 3 == 1 ? 100.0 : -100.0;
    for (const Point3& corner : {Point3{0, 0, 0}, Point3{side, 0, 0}, Point3{0, side, 0}}) {
      entities.corners.push_back({corner[0] + inputs::uniform(random),
                                  corner[1] + inputs::uniform(random), inputs::uniform(random)});
    }
    // Which corner comes first makes no difference.
    std::rotate(entities.corners.end() - 3, entities.corners.end() - 3 + (i / 3) % 3,
                entities.corners.end());
  }
  HierarchyOptions options;
  options.block_size = 600;
  const BuiltEntities built(entities, options);
  const RecordedBlock& block = built.sink.levels[0][0];
  ASSERT_EQ(block.representatives.size(), 3u);
  for (std::size_t c = 0; c < 3; ++c) {
    for (const std::uint32_t i : block.members(c)) EXPECT_EQ(i % 3, block.representatives[c] % 3);
  }
}

// A channel that is worth more than the whole soup separates its values.
TEST(HierarchyEntities, ChannelsSeparateClusters) {
  std::mt19937_64 random(9);
  const Entities entities = soup(700, 3, false, random);
  for (const double weight : {1e5, 1e200}) {
    HierarchyOptions options;
    options.block_size = 500;
    options.block.facility_cost = 0.2;
    options.channels.weights = {weight};
    const BuiltEntities built(entities, options);
    for (const RecordedBlock& block : built.sink.levels[0]) {
      EXPECT_GE(block.representatives.size(), 7u);
      for (std::size_t c = 0; c < block.representatives.size(); ++c) {
        for (const std::uint32_t i : block.members(c)) {
          EXPECT_EQ(block.id(i) % 7, block.id(block.representatives[c]) % 7);
        }
      }
    }
  }
}

TEST(HierarchyEntities, HandlesEqualAndHugeEntities) {
  for (const double scale : {0.0, 1e-140, 1e140}) {
    SCOPED_TRACE(scale);
    std::mt19937_64 random(8);
    Entities entities = soup(700, 3, false, random);
    for (Point3& p : entities.corners) {
      for (double& x : p) x = scale == 0.0 ? 7.0 : x * scale;
    }
    HierarchyOptions options;
    options.block_size = 100;
    for (const double weight : {0.0, 1e-150, 1.0, 1e150}) {
      options.channels.weights.assign(weight > 0.0 ? 1 : 0, weight);
      const BuiltEntities built(entities, options);
      laws::check_hierarchy(built.sink, built.result, entities.first_corners(), options.block_size);
    }
  }
}

TEST(HierarchyEntities, RejectsUnsupportedOptionsAndBadCorners) {
  RecordingSink sink;
  std::mt19937_64 random(1);
  const Entities triangles = soup(50, 3, false, random);
  HierarchyOptions good;
  good.block_size = 20;
  good.payload_size = sizeof(std::uint64_t);
  good.corners = triangles.reader();
  const auto refused = [&](auto change) {
    HierarchyOptions options = good;
    change(options);
    EXPECT_THROW(HierarchyBuilder(options, sink), std::invalid_argument);
  };
  refused([](HierarchyOptions& o) { o.corners.count = 0; });
  refused([](HierarchyOptions& o) { o.corners.count = 4; });
  refused([](HierarchyOptions& o) { o.corners.read = nullptr; });
  refused([](HierarchyOptions& o) { o.metric = SquaredEuclidean{}; });
  refused([](HierarchyOptions& o) { o.metric_of = [](const Box3&) { return Euclidean{}; }; });
  refused([](HierarchyOptions& o) {
    o.outlier_price = 1.0;
    o.mark_outlier = [](std::span<std::byte>) {};
  });

  // Failures in the stream: a corner that is not finite, and a search that needs points.
  Entities broken = triangles;
  broken.corners[3 * 30 + 2][1] = std::numeric_limits<double>::quiet_NaN();
  HierarchyOptions options = good;
  options.corners = broken.reader();
  const auto build = [&] {
    RecordingSink own;
    HierarchyBuilder builder(options, own);
    builder.push(triangles.first_corners(), numbered_payload(0, triangles.size()));
    (void)builder.finish();
  };
  try {
    build();
    FAIL() << "a NaN corner was accepted";
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("corner 2 of entity 10 in block 1 of level 0"),
              std::string::npos)
        << e.what();
  }
  options = good;
  options.strategy = FacilityStrategy::kd_tree;
  EXPECT_THROW(build(), std::invalid_argument);
  options.strategy = FacilityStrategy::full_scan;
  EXPECT_NO_THROW(build());
}

}  // namespace
}  // namespace terrace::cluster
