// SPDX-License-Identifier: Apache-2.0
#include <limits>

#include <gtest/gtest.h>

#include "linkage_laws.hpp"
#include "terrace/cluster/linkage.hpp"

namespace terrace::cluster {
namespace {

using laws::message_of;

/// Returns a random symmetric matrix. If `levels` is not 0, it has that many different values, so
/// that most are equal.
laws::Distances random_distances(std::size_t count, unsigned levels, std::mt19937_64& random) {
  laws::Distances d(count, std::vector<double>(count, 0.0));
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double u = inputs::uniform(random);
      d[i][j] = d[j][i] = levels == 0 ? u : std::floor(u * levels);
    }
  }
  return d;
}

PairDistance lookup(const laws::Distances& d) {
  return [&d](std::uint32_t i, std::uint32_t j) {
    EXPECT_LT(i, j);
    return d[i][j];
  };
}

BandMatrix<double> band_of(const laws::Distances& d) {
  BandMatrix<double> matrix(d.size());
  for (std::size_t i = 0; i < d.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) matrix.set(i, j, d[i][j]);
  }
  return matrix;
}

TEST(CompleteLinkage, EqualsTheTextbook) {
  for (const std::size_t count : {2u, 3u, 4u, 5u, 8u, 17u, 40u, 150u}) {
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      for (const auto& [name, points] : laws::linkage_inputs(count, seed)) {
        SCOPED_TRACE(testing::Message() << name << ", " << count << " points, seed " << seed);
        const laws::Distances d = laws::distances_of(points);
        ASSERT_EQ(laws::complete_fault(complete_linkage(points), d, 1e-14), "");
        if (name == "geometric spacing" && count > 100) continue;  // beyond the range of float
        ASSERT_EQ(laws::complete_fault(complete_linkage(points, {.entry = MatrixEntry::float32}), d,
                                       laws::kFloatTolerance),
                  "");
      }
    }
  }
}

/// The checker must accept valid runs of other devices: the order of merges at equal distances may
/// change the heights that follow.
TEST(CompleteLinkage, EqualDistancesAllowRunsOfDifferentHeights) {
  const laws::Distances d = laws::distances_of({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}});
  const Dendrogram pairs{4, {{0, 1, 1, 2}, {2, 3, 1, 2}, {4, 5, 3, 4}}};
  const Dendrogram middle{4, {{1, 2, 1, 2}, {0, 4, 2, 3}, {3, 5, 3, 4}}};
  EXPECT_EQ(laws::complete_fault(pairs, d, 0.0), "");
  EXPECT_EQ(laws::complete_fault(middle, d, 0.0), "");
  const Dendrogram low{4, {{0, 1, 1, 2}, {2, 3, 1, 2}, {4, 5, 2, 4}}};
  EXPECT_EQ(laws::complete_fault(low, d, 0.0), "row 2: wrong height");
  const Dendrogram early{4, {{0, 1, 1, 2}, {2, 4, 2, 3}, {3, 5, 3, 4}}};
  EXPECT_EQ(laws::complete_fault(early, d, 0.0), "row 1: others are nearer");
}

TEST(CompleteLinkage, HeightsEqualTheTextbook) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::vector<Point3> points = inputs::cube(100 + seed, random);
    const std::vector<double> expected = laws::brute_heights(laws::distances_of(points), true);
    const Dendrogram dendrogram = complete_linkage(points);
    for (std::size_t r = 0; r < expected.size(); ++r) {
      ASSERT_NEAR(dendrogram.merges[r].height, expected[r], 1e-14 * expected[r]);
    }
  }
}

TEST(CompleteLinkage, AcceptsAnyDistances) {
  for (const std::size_t count : {2u, 3u, 6u, 7u, 31u, 64u, 130u}) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      for (const unsigned levels : {0u, 1u, 3u, 50u}) {
        SCOPED_TRACE(testing::Message()
                     << count << " things, " << levels << " levels, seed " << seed);
        std::mt19937_64 random(seed);
        const laws::Distances d = random_distances(count, levels, random);
        const Dendrogram dendrogram = complete_linkage(count, lookup(d));
        ASSERT_EQ(laws::complete_fault(dendrogram, d, 0.0), "");
        const Dendrogram of_matrix = complete_linkage(band_of(d));
        ASSERT_EQ(laws::complete_fault(of_matrix, d, 0.0), "");
        if (levels == 0) {
          ASSERT_EQ(dendrogram, of_matrix);
        }
        ASSERT_EQ(laws::complete_fault(
                      complete_linkage(count, lookup(d), {.entry = MatrixEntry::float32}), d,
                      laws::kFloatTolerance),
                  "");
      }
    }
  }
}

TEST(CompleteLinkage, DoesNotDependOnThreadsOrInstructionSet) {
  for (const auto& [name, points] : laws::linkage_inputs(801, 3)) {
    if (name == "geometric spacing") continue;  // distances exceed the range of double
    SCOPED_TRACE(testing::Message() << name << ", seed 3");
    for (const MatrixEntry entry : {MatrixEntry::float32, MatrixEntry::float64}) {
      const Dendrogram one = complete_linkage(points, {.entry = entry, .path = SimdPath::portable});
      ASSERT_EQ(dendrogram_fault(one), "");
      for (const SimdPath path : {SimdPath::portable, SimdPath::avx2, SimdPath::avx512}) {
        if (path > best_simd_path()) continue;
        for (const unsigned threads : {1u, 3u}) {
          ASSERT_EQ(one,
                    complete_linkage(points, {.threads = threads, .entry = entry, .path = path}));
        }
      }
    }
  }
}

/// Each point is farther from the previous one than all others are, so a round merges only one
/// pair.
TEST(CompleteLinkage, GeometricSpacingUsesTheChain) {
  for (const std::size_t count : {600u, 1000u}) {
    std::vector<Point3> points;
    double x = 1;
    for (std::size_t i = 0; i < count; ++i, x *= 2.02) points.push_back({x, 0, 0});
    const auto distance = [&](std::uint32_t i, std::uint32_t j) {
      return points[j][0] - points[i][0];
    };
    const Dendrogram dendrogram = complete_linkage(count, distance);
    ASSERT_EQ(dendrogram_fault(dendrogram), "");
    for (std::uint32_t r = 0; r < dendrogram.merges.size(); ++r) {
      ASSERT_EQ(dendrogram.merges[r].height, points[r + 1][0] - points[0][0]);
    }
  }
}

TEST(CompleteLinkage, GridsTakeFewRounds) {
  // Merging one pair per round would take seconds here.
  std::vector<Point3> points;
  for (unsigned i = 0; i < 4096; ++i) {
    points.push_back({static_cast<double>(i % 16), static_cast<double>(i / 16 % 16),
                      static_cast<double>(i / 256)});
  }
  const Dendrogram dendrogram = complete_linkage(points);
  ASSERT_EQ(dendrogram_fault(dendrogram), "");
  EXPECT_EQ(dendrogram.merges[0].height, 1.0);
  EXPECT_EQ(dendrogram.merges.back().height, std::sqrt(3 * 225.0));
  const auto members = laws::members_of(dendrogram);
  for (std::size_t r = 0; r < 3000; ++r) {
    const auto& both = members[4096 + r];
    double farthest = 0;
    for (const std::uint32_t i : both) {
      for (const std::uint32_t j : both) {
        double sum = 0;
        for (unsigned a = 0; a < 3; ++a) {
          sum += (points[i][a] - points[j][a]) * (points[i][a] - points[j][a]);
        }
        farthest = std::max(farthest, std::sqrt(sum));
      }
    }
    ASSERT_EQ(dendrogram.merges[r].height, farthest);  // the cluster's diameter
  }
}

TEST(CompleteLinkage, HandlesFewPointsAndNamesBadOnes) {
  EXPECT_TRUE(complete_linkage(std::vector<Point3>{}).merges.empty());
  EXPECT_TRUE(complete_linkage(std::vector<Point3>{{1, 2, 3}}).merges.empty());
  const auto nothing = [](std::uint32_t, std::uint32_t) { return 0.0; };
  EXPECT_TRUE(complete_linkage(0, nothing).merges.empty());
  EXPECT_TRUE(complete_linkage(1, nothing).merges.empty());
  EXPECT_TRUE(complete_linkage(BandMatrix<float>(0)).merges.empty());
  EXPECT_TRUE(complete_linkage(BandMatrix<float>(1)).merges.empty());
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -2e307}) {
    std::vector<Point3> points(10, Point3{1, 2, 3});
    points[6][1] = bad;
    EXPECT_PRED2(laws::contains, message_of([&] { (void)complete_linkage(points); }), "point 6");
  }
}

TEST(CompleteLinkage, NamesBadDistances) {
  for (const std::size_t count : {7u, 8u}) {
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -1.0}) {
      std::mt19937_64 random(1);
      laws::Distances d = random_distances(count, 0, random);
      d[1][5] = d[5][1] = bad;
      EXPECT_PRED2(laws::contains, message_of([&] { (void)complete_linkage(count, lookup(d)); }),
                   "1 and 5");
      EXPECT_PRED2(laws::contains, message_of([&] { (void)complete_linkage(band_of(d)); }),
                   "1 and 5");
    }
  }
  const auto large = [](std::uint32_t, std::uint32_t) { return 1e39; };
  EXPECT_EQ(complete_linkage(3, large).merges.back().height, 1e39);
  EXPECT_PRED2(laws::contains, message_of([&] {
                 (void)complete_linkage(3, large, {.entry = MatrixEntry::float32});
               }),
               "0 and 1");
  BandMatrix<double> matrix(4);
  for (std::size_t i = 0; i < 8; ++i) matrix.row(0)[i] = 1.0;
  matrix.row(3)[1] = 2.0;
  EXPECT_PRED2(laws::contains, message_of([&] { (void)complete_linkage(std::move(matrix)); }),
               "1 and 3");
}

TEST(CompleteLinkage, RethrowsExceptionsOfTheDistance) {
  const auto throwing = [](std::uint32_t i, std::uint32_t j) -> double {
    if (i == 3 && j == 40) throw std::runtime_error("no distance");
    return 1.0;
  };
  for (const unsigned threads : {1u, 2u}) {
    EXPECT_THROW((void)complete_linkage(100, throwing, {.threads = threads}), std::runtime_error);
  }
}

TEST(CompleteLinkage, RejectsMatricesAboveTheLimit) {
  const std::vector<Point3> points(101, Point3{1, 2, 3});
  EXPECT_PRED2(laws::contains,
               message_of([&] { (void)complete_linkage(points, {.memory_limit = 40399}); }),
               "40400 bytes");
  EXPECT_EQ(message_of([&] { (void)complete_linkage(points, {.memory_limit = 40400}); }),
            "no exception");
  EXPECT_EQ(message_of([&] {
              (void)complete_linkage(points,
                                     {.entry = MatrixEntry::float32, .memory_limit = 20200});
            }),
            "no exception");
}

// The other tests silently skip instruction sets that the machine lacks. These two report it.
TEST(InstructionSets, Avx2IsTested) {
  if (best_simd_path() < SimdPath::avx2) GTEST_SKIP() << "the processor lacks AVX2";
}

TEST(InstructionSets, Avx512IsTested) {
  if (best_simd_path() < SimdPath::avx512) GTEST_SKIP() << "the processor lacks AVX-512";
}

}  // namespace
}  // namespace terrace::cluster
