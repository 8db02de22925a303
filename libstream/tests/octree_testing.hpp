// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "point_files.hpp"
#include "terrace/stream/schema.hpp"

/// Checks for all files that are read by their octree.

namespace terrace::stream {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr Box3 kEverywhere{{-kInfinity, -kInfinity, -kInfinity},
                                  {kInfinity, kInfinity, kInfinity}};

/// A place in the CRS and a hash of the packed attributes.
using Record = std::pair<Point3, std::size_t>;

/// Returns the records inside a region, sorted, so that they are equal for the same points in any
/// order.
inline std::vector<Record> records(const AllPoints& all, const Box3& region = kEverywhere) {
  std::vector<Record> records_inside;
  const std::size_t bytes = all.info.payload_size();
  for (std::size_t i = 0; i < all.points.size(); ++i) {
    const Point3 at = world_point(all.info, all.points.positions[i]);
    if (!region.contains(at)) continue;
    const auto* const payload = reinterpret_cast<const char*>(all.points.payload.data());
    const std::string_view packed(payload + i * bytes, bytes);
    records_inside.emplace_back(at, std::hash<std::string_view>()(packed));
  }
  std::sort(records_inside.begin(), records_inside.end());
  return records_inside;
}

/// Checks that regions of each file, which have the points `all`, contain exactly those inside.
inline void expect_parts_of_regions(const std::vector<std::string>& files, const AllPoints& all) {
  Box3 bounds;
  for (const Point3& p : all.points.positions) bounds.include(world_point(all.info, p));
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> part(-0.1, 1.1);
  for (int round = 0; round < 8; ++round) {
    Box3 region = kEverywhere;
    for (std::size_t axis = 0; axis < (round % 2 == 0 ? 2u : 3u); ++axis) {
      const double side = bounds.max[axis] - bounds.min[axis];
      const double a = bounds.min[axis] + part(random) * side;
      const double b = bounds.min[axis] + part(random) * side;
      region.min[axis] = std::min(a, b);
      region.max[axis] = std::max(a, b);
    }
    const std::vector<Record> expected = records(all, region);
    for (const std::string& name : files) {
      for (const unsigned threads : {1u, 3u}) {
        SourceOptions options{.threads = threads};
        options.selection.region = region;
        const auto source = open_source(std::span(&name, 1), options);
        EXPECT_TRUE(records(read_all(*source)) == expected) << name;
        EXPECT_EQ(source->progress().excluded, all.points.size() - expected.size());
      }
    }
  }
}

/// Checks that each depth of the file's octree includes the points of the previous one and more.
inline void expect_coarser_parts(const std::string& file) {
  const AllPoints all = read_file(file);
  ASSERT_TRUE(all.info.octree);
  std::vector<Record> finer = records(all);
  double spacing = all.info.octree->spacing;
  std::vector<double> spacings;
  for (unsigned depth = 0; depth < all.info.octree->depths; ++depth, spacing /= 2) {
    spacings.push_back(spacing);
  }
  for (auto step = spacings.rbegin(); step != spacings.rend(); ++step) {
    SourceOptions options;
    options.selection.resolution = *step;
    const AllPoints coarse = read_file(file, options);
    const std::vector<Record> coarse_records = records(coarse);
    EXPECT_EQ(coarse.info.octree->depths, spacings.rend() - step);
    EXPECT_TRUE(
        std::includes(finer.begin(), finer.end(), coarse_records.begin(), coarse_records.end()));
    EXPECT_TRUE(step == spacings.rbegin() ? coarse_records.size() == finer.size()
                                          : coarse_records.size() < finer.size());
    finer = coarse_records;
  }
}

}  // namespace terrace::stream
