// SPDX-License-Identifier: Apache-2.0
// Tests of surfaces in stores: what is written is read back, and damage is found.
#include "terrace/stream/stored_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "stand_in_hierarchy.hpp"
#include "store_editing.hpp"
#include "store_testing.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/store.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;
constexpr unsigned kSeed = 5;

/// A random surface that keeps the rules: from level to level, some vertices of each cluster move
/// onto others that remain or move later. A tenth of the points is not on it.
StoredSurface random_surface(const ClusterOrder& order, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  StoredSurface surface(order.points());
  std::vector<std::vector<std::uint32_t>> remaining(order.clusters.size());
  double error = 0.001;
  for (std::size_t c = order.clusters.size(); c-- > 0;) {
    const auto& cluster = order.clusters[c];
    const unsigned level = level_of(cluster.id);
    std::vector<std::uint32_t> here;
    if (level == 0) {
      for (std::uint32_t v = cluster.begin; v < cluster.end; ++v) {
        if (random() % 10 != 0) here.push_back(v);
      }
    } else {
      for (std::size_t below = c + 1; below < cluster.next; below = order.clusters[below].next) {
        here.insert(here.end(), remaining[below].begin(), remaining[below].end());
      }
    }
    std::shuffle(here.begin(), here.end(), random);
    const std::size_t kept = std::min<std::size_t>(here.size(), 1 + random() % 3);
    while (here.size() > kept) {
      const std::uint32_t v = here.back();
      here.pop_back();
      if (v == cluster.representative) {
        remaining[c].push_back(v);
        continue;
      }
      surface.parents[v] = here[random() % here.size()];
      surface.levels[v] = static_cast<std::uint8_t>(level);
      surface.errors[v] = error;
    }
    remaining[c].insert(remaining[c].end(), here.begin(), here.end());
    // A shorter list of errors than points: those of a cluster are equal, and grow upward.
    error = 0.001 * std::pow(10.0, level) * (1.0 + static_cast<double>(random() % 1000) / 1000);
  }
  return surface;
}

/// Makes the errors grow towards the parents, gives the roots theirs and every vertex a triangle.
void complete(const ClusterOrder& order, std::uint64_t seed, StoredSurface& surface) {
  std::mt19937_64 random(seed);
  const auto top = static_cast<std::uint8_t>(level_of(order.clusters.front().id));
  std::vector<std::uint32_t> vertices;
  std::vector<bool> is_parent(order.points(), false);
  for (const std::uint32_t p : surface.parents) {
    if (p != kNoNumber) is_parent[p] = true;
  }
  for (std::uint32_t v = 0; v < order.points(); ++v) {
    if (surface.parents[v] == kNoNumber && !is_parent[v]) continue;
    vertices.push_back(v);
    if (surface.parents[v] != kNoNumber) continue;
    surface.errors[v] = std::numeric_limits<double>::infinity();
    surface.levels[v] = top;
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (const std::uint32_t v : vertices) {
      const std::uint32_t p = surface.parents[v];
      if (p == kNoNumber || surface.errors[v] <= surface.errors[p]) continue;
      surface.errors[p] = surface.errors[v];
      changed = true;
    }
  }
  const auto count = vertices.size();
  for (std::size_t i = 0; i < 2 * count; ++i) {
    // Mostly near each other, some far apart.
    const auto near = [&](std::size_t k) {
      return vertices[(i / 2 + (random() % 16 == 0 ? random() % count : k)) % count];
    };
    const std::array<std::uint32_t, 3> t{vertices[i / 2], near(1 + i % 2), near(3 + i % 2)};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) surface.triangles.push_back(t);
  }
  for (std::size_t i = 0; i < count; ++i) {
    surface.triangles.push_back(
        {vertices[i], vertices[(i + 5) % count], vertices[(i + 7) % count]});
  }
}

std::vector<std::array<std::uint32_t, 3>> sorted(std::vector<std::array<std::uint32_t, 3>> all) {
  for (auto& t : all) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  std::sort(all.begin(), all.end());
  return all;
}

double rounded_up(double error) {
  const auto bits = std::bit_cast<std::uint64_t>(error);
  return std::bit_cast<double>((bits + (std::uint64_t{1} << 44) - 1) >> 44 << 44);
}

class StoredSurfaceTest : public ::testing::Test {
 protected:
  /// Writes a store of some levels with a random surface.
  void SetUp() override {
    const StoreSchema schema = testing::cloud_schema();
    std::mt19937_64 random(kSeed);
    StoreWriter writer(path_, schema);
    testing::StandInHierarchy hierarchy(
        schema.payload_size(), {.block_points = 100, .cluster_points = 10, .scale = {1, 1, 1}},
        [&](const ClusteredBlock& block) {
          if (block.representatives[0] != kNoRepresentative) {
            writer.append(writer.encode(block));
            return;
          }
          bytes_ = writer.finish(block, true, [&](const Store& store, const ClusterOrder& order) {
            EXPECT_FALSE(store.surface());
            surface_ = random_surface(order, kSeed);
            complete(order, kSeed, surface_);
            return surface_;
          });
        });
    for (int block = 0; block < 24; ++block) {
      std::vector<Point3> points(100);
      for (Point3& p : points) {
        for (double& c : p) c = static_cast<double>(random() % 100000) / 1000;
      }
      hierarchy.push(points);
    }
    hierarchy.finish();
  }

  TempFolder folder_;
  fs::path path_ = folder_.path() / "store";
  std::uint64_t bytes_ = 0;
  StoredSurface surface_{0};
};

TEST_F(StoredSurfaceTest, IsReadBack) {
  const Store store = Store::open(path_);
  EXPECT_EQ(store.bytes(), bytes_);
  ASSERT_GE(store.top(), 2U);
  const ClusterOrder order = cluster_order(store);
  EXPECT_EQ(order.points(), store.points());
  const auto info = store.surface();
  ASSERT_TRUE(info);
  EXPECT_EQ(info->triangles, surface_.triangles.size());
  const StoredSurface read = store.read_surface(order);
  EXPECT_EQ(read.parents, surface_.parents);
  EXPECT_EQ(read.levels, surface_.levels);
  for (std::size_t v = 0; v < surface_.errors.size(); ++v) {
    EXPECT_EQ(read.errors[v], rounded_up(surface_.errors[v])) << v;
  }
  EXPECT_EQ(sorted(read.triangles), sorted(surface_.triangles));
  EXPECT_TRUE(store.verify([](const Problem& p) { ADD_FAILURE() << p.file << ": " << p.what; }));
  EXPECT_TRUE(Store::ownership_of(path_).ours);
  // The bytes do not depend on the order of triangles and corners.
  StoredSurface turned = surface_;
  std::reverse(turned.triangles.begin(), turned.triangles.end());
  for (auto& t : turned.triangles) std::rotate(t.begin(), t.begin() + 1, t.end());
  EXPECT_EQ(encode_surface(order, turned), encode_surface(order, surface_));
}

TEST_F(StoredSurfaceTest, NumbersFollowTheHierarchy) {
  const Store store = Store::open(path_);
  const ClusterOrder order = cluster_order(store);
  std::vector<Point3> places(order.points());
  for (const auto& cluster : order.clusters) {
    if (level_of(cluster.id) > 0) continue;
    ClusterPoints points;
    store.read(cluster.id, points);
    ASSERT_EQ(points.size() + (points.has_representative ? 1 : 0), cluster.end - cluster.begin);
    std::copy(points.positions.begin(), points.positions.end(), places.begin() + cluster.begin);
    if (points.has_representative) places[cluster.end - 1] = points.representative;
  }
  for (const auto& cluster : order.clusters) {
    ClusterPoints points;
    store.read(cluster.id, points);
    EXPECT_EQ(cluster.representative != kNoNumber, points.has_representative);
    if (points.has_representative) {
      EXPECT_EQ(places[cluster.representative], points.representative);
    }
    if (cluster.parent == kNoNumber) continue;
    EXPECT_LE(order.clusters[cluster.parent].begin, cluster.begin);
    EXPECT_GE(order.clusters[cluster.parent].end, cluster.end);
  }
}

TEST_F(StoredSurfaceTest, StoresWithoutOneHaveNone) {
  const fs::path path = folder_.path() / "other";
  testing::write_store(
      path, testing::grid_schema(ScalarType::i16),
      testing::grid_blocks(ScalarType::i16, testing::ReliefKind::fractal, 30, 30, 20, kSeed),
      {.block_points = 400, .cluster_points = 10, .scale = {1, 1, 1}});
  const Store store = Store::open(path);
  EXPECT_FALSE(store.surface());
  EXPECT_THROW(static_cast<void>(store.read_surface(cluster_order(store))), Error);
}

TEST_F(StoredSurfaceTest, RefusesSurfacesThatBreakTheRules) {
  const ClusterOrder order = cluster_order(Store::open(path_));
  const auto refused = [&](const StoredSurface& bad) {
    EXPECT_THROW(static_cast<void>(encode_surface(order, bad)), std::invalid_argument);
  };
  refused(StoredSurface(3));
  std::uint32_t mover = 0;
  while (surface_.parents[mover] == kNoNumber) ++mover;
  StoredSurface bad = surface_;
  bad.triangles[0][1] = bad.triangles[0][0];
  refused(bad);
  bad = surface_;
  bad.triangles[0][1] = order.points();
  refused(bad);
  bad = surface_;
  bad.errors[mover] = std::numeric_limits<double>::infinity();
  refused(bad);
  bad = surface_;
  bad.parents[mover] = order.points();
  refused(bad);
  bad = surface_;
  bad.levels[mover] = 200;
  refused(bad);
  bad = surface_;
  // Out of its cluster of level 0.
  for (std::uint32_t v = 0; v < order.points(); ++v) {
    if (bad.levels[v] != 0 || bad.parents[v] == kNoNumber) continue;
    const std::uint32_t far = v < order.points() / 2 ? order.points() - 1 : order.points() / 4;
    bad.parents[v] = far;
    bad.errors[v] = 0;
    break;
  }
  refused(bad);
}

TEST_F(StoredSurfaceTest, FindsDamage) {
  const Store store = Store::open(path_);
  const ClusterOrder order = cluster_order(store);
  const std::vector<std::byte> good = encode_surface(order, surface_);
  EXPECT_NO_THROW(static_cast<void>(decode_surface(order, good, "good")));
  for (std::size_t size = 0; size < good.size(); size += 1 + size / 64) {
    EXPECT_THROW(static_cast<void>(decode_surface(order, std::span(good).first(size), "short")),
                 Error)
        << size;
  }
  std::mt19937_64 random(kSeed);
  for (int round = 0; round < 2000; ++round) {
    std::vector<std::byte> bad = good;
    bad[round < 200 ? static_cast<std::size_t>(round) : random() % bad.size()] ^=
        std::byte{static_cast<std::uint8_t>(1 + random() % 255)};
    EXPECT_THROW(static_cast<void>(decode_surface(order, bad, "damaged")), Error)
        << "seed " << kSeed << ", round " << round;
  }
  // The same with recomputed checksums, by a store of other points: nothing but Error.
  std::vector<std::byte> longer = good;
  longer.push_back(std::byte{0});
  EXPECT_THROW(static_cast<void>(decode_surface(order, longer, "longer")), Error);
}

TEST_F(StoredSurfaceTest, VerifyFindsADamagedFile) {
  testing::StoreFiles files = testing::read_files(path_);
  ASSERT_TRUE(files.contains("surface.0"));
  files["surface.0"][files["surface.0"].size() / 2] ^= 1;
  testing::write_files(path_, files);
  int problems = 0;
  EXPECT_FALSE(Store::open(path_).verify([&](const Problem& problem) {
    ++problems;
    EXPECT_EQ(problem.file, "surface.0");
  }));
  EXPECT_EQ(problems, 1);
  fs::remove(path_ / "surface.0");
  EXPECT_FALSE(Store::open(path_).verify([](const Problem&) {}));
  EXPECT_THROW(
      static_cast<void>(Store::open(path_).read_surface(cluster_order(Store::open(path_)))), Error);
}

}  // namespace
}  // namespace terrace::stream
