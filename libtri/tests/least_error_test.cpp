// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/least_error.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace terrace::tri {
namespace {

constexpr double kRange = 1000.0;

/// The outcome of a search in which the numbers of vertices are known.
struct Outcome {
  bool found = false;
  int runs = 0;
  double bound = -1.0, vertices = 0.0;  ///< of the last run
};

Outcome search(std::uint64_t most, const VertexCount& count, const VertexCount& estimate) {
  Outcome outcome;
  outcome.found = least_error(
      {.max_vertices = most, .range = kRange, .estimate = estimate, .run = [&](double bound) {
         EXPECT_GE(bound, 0.0);
         EXPECT_LE(bound, kRange);
         ++outcome.runs;
         outcome.bound = bound;
         return outcome.vertices = count(bound);
       }});
  return outcome;
}

/// Relief with a spectrum: from all samples at a bound of 0 to the corners alone.
VertexCount relief(double samples, double power) {
  return [=](double bound) {
    return std::floor(4.0 + samples / (1.0 + std::pow(bound / 0.3, power)));
  };
}

TEST(LeastError, UsesNearlyAllVertices) {
  for (const double power : {0.8, 1.3, 2.0, 2.6}) {
    const VertexCount count = relief(1e7, power);
    for (const std::uint64_t most : {1000U, 20'000U, 1'000'000U, 5'000'000U}) {
      SCOPED_TRACE(std::to_string(power) + ", " + std::to_string(most));
      const auto limit = static_cast<double>(most);
      if (count(kRange) > limit) continue;
      const Outcome plain = search(most, count, {});
      EXPECT_TRUE(plain.found);
      EXPECT_LE(plain.vertices, limit);
      EXPECT_GE(plain.vertices, 0.98 * limit);
      EXPECT_LE(plain.runs, 12);
      // The estimate is 40 % too high and has another slope.
      const VertexCount estimate = [&](double bound) { return 1.4 * std::pow(count(bound), 1.02); };
      const Outcome estimated = search(most, count, estimate);
      EXPECT_LE(estimated.vertices, limit);
      EXPECT_GE(estimated.vertices, 0.98 * limit);
      EXPECT_LE(estimated.runs, 3);
    }
  }
}

TEST(LeastError, CountsBeyondTheLimitMayBeEstimates) {
  const VertexCount count = relief(1e6, 1.7);
  for (const std::uint64_t most : {5'000U, 100'000U}) {
    const auto limit = static_cast<double>(most);
    const VertexCount rough_count = [&](double bound) {
      const double vertices = count(bound);
      return vertices <= limit ? vertices : std::max(limit + 1, 0.6 * vertices);
    };
    for (const VertexCount& estimate : {VertexCount{}, count}) {
      const Outcome outcome = search(most, rough_count, estimate);
      EXPECT_LE(outcome.vertices, limit);
      EXPECT_GE(outcome.vertices, 0.98 * limit);
    }
  }
}

TEST(LeastError, StopsAtAStepOfTheCount) {
  // 100 vertices below a bound of 7, 60 from there on.
  const VertexCount steps = [](double bound) { return bound < 7.0 ? 100.0 : 60.0; };
  for (const VertexCount& estimate : {VertexCount{}, steps, relief(1e6, 1.0)}) {
    const Outcome outcome = search(80, steps, estimate);
    EXPECT_TRUE(outcome.found);
    EXPECT_EQ(outcome.vertices, 60.0);
    EXPECT_GE(outcome.bound, 7.0);
    EXPECT_LE(outcome.bound, 7.0 * 1.01);
    EXPECT_LE(outcome.runs, 25);
  }
}

TEST(LeastError, ReachesZeroIfAllSamplesFit) {
  const VertexCount count = relief(1e4, 1.5);
  for (const VertexCount& estimate : {VertexCount{}, count}) {
    const Outcome outcome = search(1'000'000, count, estimate);
    EXPECT_TRUE(outcome.found);
    EXPECT_EQ(outcome.bound, 0.0);
  }
}

TEST(LeastError, FailsIfEvenTheFlattestMeshHasTooMany) {
  const VertexCount count = relief(1e7, 1.0);
  for (const VertexCount& estimate : {VertexCount{}, count}) {
    EXPECT_FALSE(search(5, count, estimate).found);
  }
}

TEST(LeastError, FlatGroundTakesOneRun) {
  int runs = 0;
  EXPECT_TRUE(
      least_error({.max_vertices = 4, .range = 0.0, .estimate = {}, .run = [&](double bound) {
                     EXPECT_EQ(bound, 0.0);
                     ++runs;
                     return 4.0;
                   }}));
  EXPECT_EQ(runs, 1);
}

TEST(LeastError, TriesNoBoundBelowTheLeast) {
  const VertexCount count = relief(1e6, 1.5);
  for (const VertexCount& estimate : {VertexCount{}, count}) {
    for (const double least : {0.1, 40.0, kRange}) {
      double last = 0.0;
      EXPECT_TRUE(least_error({.max_vertices = 500'000,
                               .least = least,
                               .range = kRange,
                               .estimate = estimate,
                               .run = [&](double bound) {
                                 EXPECT_GE(bound, least);
                                 EXPECT_LE(bound, kRange);
                                 last = bound;
                                 return count(bound);
                               }}));
      if (count(least) <= 500'000) {
        EXPECT_EQ(last, least);
      }
    }
  }
}

TEST(LeastError, ToleratesAUselessEstimate) {
  const VertexCount count = relief(1e6, 1.7);
  const Outcome outcome = search(50'000, count, [](double) { return 17.0; });
  EXPECT_LE(outcome.vertices, 50'000.0);
  EXPECT_GE(outcome.vertices, 49'000.0);
}

}  // namespace
}  // namespace terrace::tri
