// SPDX-License-Identifier: GPL-3.0-or-later
#include "synth/synth_cloud.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

constexpr std::uint64_t kOrderMemory = 1 << 20;

TEST(Permutation, IsBijectiveForEverySize) {
  for (std::uint64_t size = 1; size < 300; ++size) {
    const Permutation permutation(size, size);
    std::vector<std::uint64_t> seen;
    for (std::uint64_t n = 0; n < size; ++n) seen.push_back(permutation(n));
    std::sort(seen.begin(), seen.end());
    for (std::uint64_t n = 0; n < size; ++n) ASSERT_EQ(seen[n], n) << size;
  }
}

TEST(Permutation, DestroysTheOrder) {
  constexpr std::uint64_t kSize = 100000;
  const Permutation permutation(kSize, 1);
  std::uint64_t fixed = 0, ascending = 0;
  for (std::uint64_t n = 0; n + 1 < kSize; ++n) {
    fixed += permutation(n) == n ? 1 : 0;
    ascending += permutation(n) < permutation(n + 1) ? 1 : 0;
  }
  EXPECT_LT(fixed, 20u);
  EXPECT_NEAR(static_cast<double>(ascending) / kSize, 0.5, 0.02);
}

TEST(DeliveryOrder, KeepsPiecesTogether) {
  constexpr std::uint64_t kSize = 5000;
  const DeliveryOrder order("pieces:20-60", kSize, 3, kOrderMemory);
  std::vector<std::uint64_t> seen;
  std::size_t breaks = 0;
  for (std::uint64_t n = 0; n < kSize; ++n) {
    seen.push_back(order(n));
    if (n > 0 && seen[n] != seen[n - 1] + 1) ++breaks;
  }
  EXPECT_GT(breaks, kSize / 60 / 2);
  EXPECT_LE(breaks, kSize / 20 + 1);
  std::sort(seen.begin(), seen.end());
  for (std::uint64_t n = 0; n < kSize; ++n) ASSERT_EQ(seen[n], n);
}

TEST(DeliveryOrder, RejectsInvalidOptions) {
  for (const char* text :
       {"some", "pieces", "pieces:5", "pieces:0-5", "pieces:7-5", "pieces:a-b"}) {
    EXPECT_THROW(DeliveryOrder(text, 10, 1, kOrderMemory), UsageError) << text;
  }
  EXPECT_THROW(DeliveryOrder("pieces:1-1", 1000000, 1, kOrderMemory), stream::Error);
}

TEST(Clouds, StayWithinTheirBounds) {
  const auto uniform = uniform_cloud(1);
  const auto surface = surface_cloud(5000, 1);
  const auto clusters = cluster_cloud(5000, 1);
  stream::Point3 mean{};
  for (std::uint64_t n = 0; n < 5000; ++n) {
    const stream::Point3 u = uniform(n), s = surface(n), c = clusters(n);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_GE(u[axis], 0);
      EXPECT_LE(u[axis], 1);
      mean[axis] += u[axis] / 5000;
      EXPECT_NEAR(c[axis], 0.5, 0.8);
    }
    const double radius = std::sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
    EXPECT_NEAR(radius, 100, 45);
  }
  for (const double m : mean) EXPECT_NEAR(m, 0.5, 0.02);
}

// Successive points of a swath are adjacent.
TEST(SurfaceCloud, RunsInSwaths) {
  const auto surface = surface_cloud(100000, 1);
  double adjacent = 0;
  for (std::uint64_t n = 20000; n < 21000; ++n) {
    const stream::Point3 a = surface(n), b = surface(n + 1);
    adjacent += std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) < 4 ? 1 : 0;
  }
  EXPECT_GT(adjacent, 900);
}

// The points must have the same bytes on every machine and with every compiler.
TEST(Clouds, BytesAreFixed) {
  std::uint64_t hash = 14695981039346656037u;  // FNV-1a
  for (const auto& cloud : {surface_cloud(1000, 1), uniform_cloud(1), cluster_cloud(1000, 1)}) {
    for (std::uint64_t n = 0; n < 1000; ++n) {
      for (const double v : cloud(n)) {
        hash = (hash ^ std::bit_cast<std::uint64_t>(v)) * 1099511628211u;
      }
    }
  }
  EXPECT_EQ(hash, 8136532929353255328u);
}

}  // namespace
}  // namespace terrace::tools
