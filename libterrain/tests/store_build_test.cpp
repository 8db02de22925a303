// SPDX-License-Identifier: Apache-2.0
// The bytes of a store are a function of input and options: not of the compiler or its
// optimisation.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <terrace/stream/store.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/detail.hpp"

namespace terrace::terrain {

namespace {

namespace fs = std::filesystem;

/// The checksum was computed by GCC at -O3; the sanitizers' build, Clang at -O1, must find it too.
/// It changes only with the format or with the clustering, which is a decision and never an
/// accident.
TEST(StoreBuild, ChecksumIsTheSameWithEveryCompiler) {
  std::string name = (fs::temp_directory_path() / "terrace-build-XXXXXX").string();
  ASSERT_NE(mkdtemp(name.data()), nullptr);
  const fs::path folder = name;
  const fs::path points = folder / "points.xyz";
  {
    std::ofstream file(points);
    // Whole centimetres by integer arithmetic: three fields with bumps and a few places given
    // twice.
    for (int i = 0; i < 4000; ++i) {
      const int x = i * 7919 % 100003, y = i * 104729 % 60013;
      const int z = 10000 + x / 13 % 700 + y / 7 % 900 + x * (y % 97) / 100000 + i * 31 % 11;
      for (int copies = i % 500 == 0 ? 2 : 1; copies > 0; --copies) {
        file << x / 100 << '.' << x / 10 % 10 << x % 10 << ' ' << y / 100 << '.' << y / 10 % 10
             << y % 10 << ' ' << z / 100 << '.' << z / 10 % 10 << z % 10 << '\n';
      }
    }
  }
  BuildRequest request;
  request.inputs = {points.string()};
  request.store = folder / "store";
  request.block_points = 500;
  request.facility_cost = 2.0;
  request.effort = cluster::Effort::standard;
  request.z_weight = 1.0;
  request.seed = 7;
  const BuildOutcome outcome = build_store(request);
  EXPECT_EQ(outcome.points, 4008u);
  EXPECT_EQ(stream::Store::open(request.store).checksum(), 0x4f6de04fu);
  fs::remove_all(folder);
}

// By the ranges of their attributes; what comes is what the condition takes of all points.
TEST(StoreBuild, ClustersThatCannotMeetAConditionAreNotRead) {
  const tests::TemporaryFolder folder;
  const fs::path points = folder.path() / "points.csv";
  {
    std::ofstream file(points);
    file << "x,y,z,class\n";
    // Strips of a class each.
    for (int i = 0; i < 20000; ++i) {
      const int x = i * 7919 % 10007, y = i * 104729 % 10009;
      file << x / 10 << '.' << x % 10 << ',' << y / 10 << '.' << y % 10 << ',' << i % 97 << ','
           << x / 1000 << '\n';
    }
  }
  BuildRequest request;
  request.inputs = {points.string()};
  request.store = folder.path() / "store";
  request.block_points = 2000;
  build_store(request);
  const stream::Store store = stream::Store::open(request.store);
  Detail detail;
  const auto visit = [&](std::uint64_t& clusters, std::uint64_t& met) {
    for_each_wanted(store, detail,
                    [&](stream::ClusterId id, const stream::ClusterRecord&,
                        const stream::ClusterPoints&) { clusters += stream::level_of(id) == 0; });
    for_each_wanted_point(store, detail,
                          [&](stream::ClusterId, const stream::ClusterPoints& of, std::size_t i,
                              const stream::Point3&) {
                            const auto classes = store.schema().view<double>(of.payload, 0);
                            met += classes[i] == 3.0 ? 1 : 0;
                          });
  };
  std::uint64_t all = 0, expected = 0, read = 0, met = 0;
  visit(all, expected);
  detail.where.emplace("class == 3", store.schema());
  visit(read, met);
  EXPECT_EQ(met, expected);
  EXPECT_GT(met, 1000u);
  EXPECT_LT(read, all / 3);
  EXPECT_GT(read, 0u);
  detail.where.emplace("x < -1 || class > 42", store.schema());
  read = met = 0;
  visit(read, met);
  EXPECT_EQ(read, 0u);
  EXPECT_EQ(met, 0u);
}

}  // namespace
}  // namespace terrace::terrain
