// SPDX-License-Identifier: Apache-2.0
// Tests the seven methods of linkage(), of points and of distances.
#include <limits>
#include <utility>

#include <gtest/gtest.h>

#include "linkage_laws.hpp"
#include "terrace/cluster/linkage.hpp"

namespace terrace::cluster {
namespace {

using laws::message_of;
using Labels = std::vector<std::uint32_t>;

constexpr LinkageMethod kMethods[] = {
    LinkageMethod::single, LinkageMethod::complete, LinkageMethod::average, LinkageMethod::weighted,
    LinkageMethod::ward,   LinkageMethod::centroid, LinkageMethod::median};

bool has_inversions(LinkageMethod method) {
  return method == LinkageMethod::centroid || method == LinkageMethod::median;
}

bool uses_matrix(LinkageMethod method) {
  return method == LinkageMethod::average || method == LinkageMethod::weighted;
}

PairDistance distances_in(const laws::Distances& d) {
  return [&d](std::uint32_t i, std::uint32_t j) { return d[i][j]; };
}

TEST(LinkageMethods, MergeTheNearestClusters) {
  for (const std::size_t count : {2u, 3u, 5u, 17u, 60u, 150u}) {
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      for (const auto& [name, points] : laws::linkage_inputs(count, seed)) {
        const laws::Distances d = laws::distances_of(points);
        for (const LinkageMethod method : kMethods) {
          SCOPED_TRACE(testing::Message() << name << ", " << count << " points, seed " << seed
                                          << ", method " << static_cast<int>(method));
          const Dendrogram dendrogram = linkage(points, method);
          ASSERT_EQ(laws::linkage_fault(dendrogram, d, method, 1e-12, 1e-13), "");
          const Dendrogram of_distances = linkage(count, distances_in(d), method);
          ASSERT_EQ(laws::linkage_fault(of_distances, d, method, 1e-12, 1e-13), "");
          // The distances of some sets exceed the range of float.
          const LinkageOptions floats{.entry = MatrixEntry::float32};
          if (uses_matrix(method)) {
            ASSERT_EQ(laws::linkage_fault(linkage(points, method, floats), d, method, 1e-5, 1e-5),
                      "");
          }
          if (name != "huge" && name != "tiny" && name != "geometric spacing") {
            ASSERT_EQ(laws::linkage_fault(linkage(count, distances_in(d), method, floats), d,
                                          method, 1e-4, 1e-4),
                      "");
          }
          if (has_inversions(method)) continue;
          const std::vector<double> heights = laws::heights_of(dendrogram);
          ASSERT_TRUE(std::is_sorted(heights.begin(), heights.end()));
        }
      }
    }
  }
}

/// Without ties there is one dendrogram, however it is found.
TEST(LinkageMethods, PointsAndTheirDistancesGiveTheSameRows) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    std::mt19937_64 random(seed);
    const std::vector<Point3> points = inputs::cube(120 + 7 * seed, random);
    const laws::Distances d = laws::distances_of(points);
    for (const LinkageMethod method : kMethods) {
      SCOPED_TRACE(testing::Message()
                   << "method " << static_cast<int>(method) << ", seed " << seed);
      const Dendrogram dendrogram = linkage(points, method);
      const Dendrogram of_distances = linkage(points.size(), distances_in(d), method);
      for (std::size_t r = 0; r < dendrogram.merges.size(); ++r) {
        const Merge &x = dendrogram.merges[r], &y = of_distances.merges[r];
        ASSERT_EQ(std::pair(x.a, x.b), std::pair(y.a, y.b)) << "row " << r;
        ASSERT_NEAR(x.height, y.height, 1e-13) << "row " << r;
      }
    }
  }
}

/// Methods that only compare and average distances must accept any distances, ties included.
TEST(LinkageMethods, AcceptAnyDistances) {
  for (const std::size_t count : {2u, 7u, 64u, 131u}) {
    for (const unsigned levels : {0u, 1u, 3u}) {
      std::mt19937_64 random(count + levels);
      laws::Distances d(count, std::vector<double>(count, 0.0));
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t j = 0; j < i; ++j) {
          const double u = inputs::uniform(random);
          d[i][j] = d[j][i] = levels == 0 ? u : std::floor(u * levels);
        }
      }
      for (const LinkageMethod method : kMethods) {
        SCOPED_TRACE(testing::Message() << "method " << static_cast<int>(method) << ", " << count
                                        << " things, " << levels << " levels");
        ASSERT_EQ(
            laws::linkage_fault(linkage(count, distances_in(d), method), d, method, 1e-12, 1e-12),
            "");
      }
    }
  }
}

/// The third corner is nearer to the middle of the others than they are to each other.
TEST(LinkageMethods, CentroidsHaveInversions) {
  const std::vector<Point3> points{{0, 0, 0}, {2, 0, 0}, {1, 1.75, 0}, {50, 0, 0}};
  for (const LinkageMethod method : {LinkageMethod::centroid, LinkageMethod::median}) {
    const Dendrogram dendrogram = linkage(points, method);
    EXPECT_EQ(dendrogram.merges[0], (Merge{0, 1, 2.0, 2}));
    EXPECT_EQ(dendrogram.merges[1], (Merge{2, 4, 1.75, 3}));
    EXPECT_EQ(cut_height(dendrogram, 1.9), (Labels{0, 1, 2, 3}));
    EXPECT_EQ(cut_height(dendrogram, 2.0), (Labels{0, 0, 0, 1}));
    EXPECT_EQ(cut_count(dendrogram, 3), (Labels{0, 0, 0, 1}));
  }
}

TEST(LinkageMethods, HaveNames) {
  EXPECT_EQ(linkage_method_named("ward"), LinkageMethod::ward);
  EXPECT_EQ(linkage_method_named("weighted"), LinkageMethod::weighted);
  EXPECT_EQ(linkage_method_named("upgma"), std::nullopt);
}

TEST(LinkageMethods, TiesGoToTheFirst) {
  const std::vector<Point3> row{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  const std::vector<Merge> pairs{{0, 1, 1, 2}, {2, 3, 1, 2}, {4, 5, 2, 4}};
  EXPECT_EQ(linkage(row, LinkageMethod::average).merges, pairs);
  EXPECT_EQ(linkage(row, LinkageMethod::centroid).merges, pairs);
  EXPECT_EQ(linkage(row, LinkageMethod::median).merges, pairs);
}

/// These inputs must take quadratic time like others: equal points, grids, and points each of which
/// is nearest to the previous one.
TEST(LinkageMethods, DegenerateInputsAreNotCubic) {
  std::vector<std::vector<Point3>> sets(3);
  double x = 1;
  for (unsigned i = 0; i < 2000 / TERRACE_TEST_SHARE; ++i, x *= 1.1) {
    sets[0].push_back({1, 2, 3});
    sets[1].push_back({double(i % 20), double(i / 20 % 20), double(i / 400)});
    sets[2].push_back({x, 0, 0});
  }
  for (const auto& points : sets) {
    for (const LinkageMethod method : kMethods) {
      const Dendrogram dendrogram = linkage(points, method);
      ASSERT_EQ(dendrogram_fault(dendrogram), "");
      ASSERT_EQ(dendrogram.merges.back().size, points.size());
    }
  }
}

TEST(LinkageMethods, DoNotDependOnThreadsOrInstructionSet) {
  for (const auto& [name, points] : laws::linkage_inputs(200, 3)) {
    SCOPED_TRACE(name);
    for (const LinkageMethod method : kMethods) {
      for (const MatrixEntry entry : {MatrixEntry::float32, MatrixEntry::float64}) {
        if (name == "geometric spacing" && method == LinkageMethod::complete) continue;
        const Dendrogram one =
            linkage(points, method, {.entry = entry, .path = SimdPath::portable});
        for (const SimdPath path : {SimdPath::portable, SimdPath::avx2, SimdPath::avx512}) {
          if (path > best_simd_path()) continue;
          for (const unsigned threads : {1u, 3u}) {
            ASSERT_EQ(one,
                      linkage(points, method, {.threads = threads, .entry = entry, .path = path}));
          }
        }
      }
    }
  }
}

TEST(LinkageMethods, RespectTheMemoryLimit) {
  std::mt19937_64 random(1);
  const std::vector<Point3> points = inputs::cube(1000, random);
  const laws::Distances d = laws::distances_of(points);
  const LinkageOptions little{.memory_limit = 1'000'000};
  for (const LinkageMethod method : kMethods) {
    SCOPED_TRACE(testing::Message() << "method " << static_cast<int>(method));
    const std::string of_points = message_of([&] { (void)linkage(points, method, little); });
    const bool matrix = uses_matrix(method) || method == LinkageMethod::complete;
    EXPECT_EQ(laws::contains(of_points, "4000000 bytes"), matrix) << of_points;
    if (method == LinkageMethod::ward || has_inversions(method)) {
      EXPECT_PRED2(laws::contains,
                   message_of([&] { (void)linkage(points, method, {.memory_limit = 1000}); }),
                   "120000 bytes");
    }
    EXPECT_PRED2(laws::contains,
                 message_of([&] { (void)linkage(1000, distances_in(d), method, little); }),
                 "4000000 bytes");
  }
}

TEST(LinkageMethods, HandleFewPointsAndNameBadOnes) {
  for (const LinkageMethod method : kMethods) {
    SCOPED_TRACE(testing::Message() << "method " << static_cast<int>(method));
    const auto bad = [](std::uint32_t i, std::uint32_t j) {
      return i == 1 && j == 3 ? std::nan("") : 1.0;
    };
    for (const std::size_t count : {0u, 1u}) {
      EXPECT_TRUE(linkage(std::vector<Point3>(count), method).merges.empty());
      EXPECT_TRUE(linkage(count, bad, method).merges.empty());
    }
    EXPECT_PRED2(laws::contains, message_of([&] { (void)linkage(5, bad, method); }), "1 and 3");
    std::vector<Point3> points(10, Point3{1, 2, 3});
    points[6][1] = std::numeric_limits<double>::infinity();
    EXPECT_PRED2(laws::contains, message_of([&] { (void)linkage(points, method); }), "point 6");
  }
}

}  // namespace
}  // namespace terrace::cluster
