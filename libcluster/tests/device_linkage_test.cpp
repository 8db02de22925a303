// SPDX-License-Identifier: Apache-2.0
// Runs the kernels of GPU linkage as loops over shuffled indices.
#include <gtest/gtest.h>

#include "cuda/device_complete.hpp"
#include "cuda/device_dendrogram.hpp"
#include "cuda/device_single.hpp"
#include "linkage_laws.hpp"
#include "loop_device.hpp"
#include "terrace/cluster/linkage.hpp"

namespace terrace::cluster {
namespace {

using laws::heights_of;

template <class Entry>
Dendrogram complete_on(LoopDevice& loop, std::span<const Point3> points) {
  return device::dendrogram_of(LinkagePoints(points), [&](std::span<const Point3> ordered) {
    return device::complete_rounds<Entry>(loop, ordered);
  });
}

Dendrogram single_on(LoopDevice& loop, std::span<const Point3> points) {
  return device::dendrogram_of(LinkagePoints(points), [&](std::span<const Point3> ordered) {
    return device::single_rounds(loop, ordered);
  });
}

TEST(DeviceLinkage, EqualsTheCpu) {
  for (const std::size_t count : {2u, 3u, 4u, 5u, 6u, 7u, 8u, 31u, 64u, 100u, 333u, 700u}) {
    for (const std::uint32_t lanes : {1u, 7u, 32u}) {
      SCOPED_TRACE(testing::Message() << count << " points, " << lanes << " lanes");
      std::mt19937_64 random(count);
      std::vector<Point3> points = inputs::cube(count, random);
      if (lanes == 7) {
        for (Point3& p : points) p[2] = 0;
      }
      LoopDevice loop(lanes, true, count);
      EXPECT_EQ(complete_on<double>(loop, points), complete_linkage(points));
      EXPECT_EQ(single_on(loop, points), single_linkage(points));
      // Distances rounded to float are sometimes equal, so several runs are valid.
      EXPECT_EQ(laws::complete_fault(complete_on<float>(loop, points), laws::distances_of(points),
                                     laws::kFloatTolerance),
                "");
    }
  }
}

TEST(DeviceLinkage, SingleLinkageUsesSeveralParts) {
  std::mt19937_64 random(12);
  const std::vector<Point3> points = inputs::cube(2500, random);
  ASSERT_GT(device::NearestOther::parts_of(2500), 2u);
  LoopDevice loop(32, true, 1);
  EXPECT_EQ(single_on(loop, points), single_linkage(points));
}

TEST(DeviceLinkage, HandlesTiesAndDegenerateInput) {
  for (const std::size_t count : {2u, 3u, 10u, 61u, 150u}) {
    for (const auto& [name, points] : laws::linkage_inputs(count, 3)) {
      SCOPED_TRACE(testing::Message() << name << ", " << count << " points");
      LoopDevice loop(5, true, 1);
      const Dendrogram complete = complete_on<double>(loop, points);
      EXPECT_EQ(laws::complete_fault(complete, laws::distances_of(points), 1e-14), "");
      const Dendrogram single = single_on(loop, points);
      EXPECT_EQ(dendrogram_fault(single), "");
      EXPECT_EQ(heights_of(single), heights_of(single_linkage(points)));
    }
  }
}

TEST(DeviceLinkage, DoesNotDependOnTheOrderOfThreads) {
  // The inputs are full of ties, so any dependence on the order would show.
  for (const auto& [name, points] : laws::linkage_inputs(200, 4)) {
    SCOPED_TRACE(name);
    LoopDevice straight(1, false, 0);
    const Dendrogram complete = complete_on<double>(straight, points);
    const Dendrogram half = complete_on<float>(straight, points);
    const Dendrogram single = single_on(straight, points);
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      LoopDevice loop(static_cast<std::uint32_t>(4 * seed), true, seed);
      EXPECT_EQ(complete_on<double>(loop, points), complete);
      EXPECT_EQ(complete_on<float>(loop, points), half);
      EXPECT_EQ(single_on(loop, points), single);
    }
  }
}

TEST(DeviceLinkage, TakesFewRoundsAndTheDocumentedMemory) {
  std::mt19937_64 random(5);
  for (const std::size_t count : {100u, 1000u}) {
    const std::vector<Point3> points = inputs::cube(count, random);
    LoopDevice loop(8, false, 0);
    std::vector<device::RoundLink> links = device::complete_rounds<float>(loop, points);
    EXPECT_LE(links.back().round, 40u);
    EXPECT_LE(loop.launches, 500u);
    EXPECT_LE(loop.bytes, device::complete_rounds_bytes<float>(count));
    EXPECT_GE(1.2 * static_cast<double>(loop.bytes) + device::kSmallMemory,
              static_cast<double>(device::complete_rounds_bytes<float>(count)));
    loop.bytes = loop.launches = 0;
    links = device::single_rounds(loop, points);
    for (const device::RoundLink& link : links) EXPECT_LT(link.round, 10u);
    EXPECT_LE(loop.bytes, device::single_rounds_bytes(count));
  }
  // Only one pair merges per round, because the nearest neighbours of all others stay the same.
  std::vector<Point3> geometric;
  double x = 1;
  for (int i = 0; i < 60; ++i, x *= 2.5) geometric.push_back({x, 0, 0});
  LoopDevice loop(8, true, 2);
  EXPECT_EQ(complete_on<double>(loop, geometric), complete_linkage(geometric));
  EXPECT_GT(loop.launches, 4u * 58);
}

}  // namespace
}  // namespace terrace::cluster
