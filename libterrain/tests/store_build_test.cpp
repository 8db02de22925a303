// SPDX-License-Identifier: Apache-2.0
// The bytes of a store are a function of input and options, not of the compiler or its
// optimisation.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/memory_source.hpp>
#include <terrace/stream/store.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/heights.hpp"
#include "terrace/terrain/profile.hpp"

namespace terrace::terrain {

namespace {

namespace fs = std::filesystem;

/// The checksum was computed with GCC at -O3; the sanitizers' build, with Clang at -O1, must give
/// the same. It changes only with the format or the clustering, which must be a deliberate
/// decision.
TEST(StoreBuild, ChecksumDoesNotDependOnCompiler) {
  std::string name = (fs::temp_directory_path() / "terrace-build-XXXXXX").string();
  ASSERT_NE(mkdtemp(name.data()), nullptr);
  const fs::path folder = name;
  const fs::path points = folder / "points.xyz";
  {
    std::ofstream file(points);
    // Whole centimetres in integer arithmetic: three fields with bumps, and a few repeated places.
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
  EXPECT_EQ(stream::Store::open(request.store).checksum(), 0xfbddf9b6u);
  fs::remove_all(folder);
}

/// Builds a store of points with `line(i)` as their lines of CSV.
stream::Store store_of_lines(const fs::path& folder, const std::string& columns, int points,
                             std::size_t block_points,
                             const std::function<void(std::ostream& file, int i)>& line) {
  const fs::path path = folder / "points.csv";
  {
    std::ofstream file(path);
    file << columns << '\n';
    for (int i = 0; i < points; ++i) {
      line(file, i);
      file << '\n';
    }
  }
  BuildRequest request;
  request.inputs = {path.string()};
  request.store = folder / "store";
  request.block_points = block_points;
  build_store(request);
  return stream::Store::open(request.store);
}

// A store with another word could not be opened.
TEST(StoreBuild, RejectsUnknownHeightReference) {
  const tests::TemporaryFolder folder;
  std::ofstream(folder.path() / "points.csv") << "x,y,z\n1,2,3\n";
  BuildRequest request;
  request.inputs = {(folder.path() / "points.csv").string()};
  request.store = folder.path() / "store";
  request.vertical = "<b>ellipsoidal</b>";
  EXPECT_THROW(build_store(request), UsageError);
  EXPECT_FALSE(fs::exists(request.store));
  request.vertical = "ellipsoidal";
  build_store(request);
  EXPECT_EQ(stream::Store::open(request.store).schema().vertical, "ellipsoidal");
}

// Clusters are skipped by the ranges of their attributes; the points must equal those that the
// condition selects from all.
TEST(StoreBuild, SkipsClustersThatCannotMeetCondition) {
  const tests::TemporaryFolder folder;
  // Strips of one class each.
  stream::Store store =
      store_of_lines(folder.path(), "x,y,z,class", 20000, 2000, [](std::ostream& file, int i) {
        const int x = i * 7919 % 10007, y = i * 104729 % 10009;
        file << x / 10 << '.' << x % 10 << ',' << y / 10 << '.' << y % 10 << ',' << i % 97 << ','
             << x / 1000;
      });
  const Detail detail;
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
  store = store.where("class == 3");
  visit(read, met);
  EXPECT_EQ(met, expected);
  EXPECT_GT(met, 1000u);
  EXPECT_LT(read, all / 3);
  EXPECT_GT(read, 0u);
  store = store.whole().where("x < -1 || class > 42");
  read = met = 0;
  visit(read, met);
  EXPECT_EQ(read, 0u);
  EXPECT_EQ(met, 0u);
}

/// Lists the clusters of its part.
class Listed final : public WantedPart {
 public:
  explicit Listed(std::vector<std::pair<stream::ClusterId, std::size_t>>& all) : all_(all) {}
  void add(stream::ClusterId id, const stream::ClusterRecord&,
           const stream::ClusterPoints& points) override {
    EXPECT_FALSE(ended_);
    part_.emplace_back(id, points.size());
  }
  void end() override { ended_ = true; }
  void take() override {
    EXPECT_TRUE(ended_);
    all_.insert(all_.end(), part_.begin(), part_.end());
  }

 private:
  std::vector<std::pair<stream::ClusterId, std::size_t>>& all_;
  std::vector<std::pair<stream::ClusterId, std::size_t>> part_;
  bool ended_ = false;
};

TEST(StoreBuild, WantedPartsComeInOrderOnAnyThreads) {
  const tests::TemporaryFolder folder;
  const stream::Store store =
      store_of_lines(folder.path(), "x,y,z", 100000, 500, [](std::ostream& file, int i) {
        file << i * 7919LL % 100003 << ',' << i * 104729LL % 100019 << ',' << i % 97;
      });
  ASSERT_GE(store.top(), 2u);
  const Region part = Region::of_box({{20000, 10000, 0}, {70000, 90000, 0}});
  for (const Detail& detail : {Detail{}, Detail{.level = 1}, Detail{.region = part},
                               Detail{.level = 1, .focuses = {{.region = part, .level = 0}}},
                               Detail{.cluster = stream::cluster_id(store.top() - 1, 3)}}) {
    std::vector<std::pair<stream::ClusterId, std::size_t>> expected;
    for_each_wanted(store, detail,
                    [&](stream::ClusterId id, const stream::ClusterRecord&,
                        const stream::ClusterPoints& of) { expected.emplace_back(id, of.size()); });
    EXPECT_GT(expected.size(), 1u);
    for (const unsigned threads : {1u, 2u, 5u}) {
      std::vector<std::pair<stream::ClusterId, std::size_t>> listed;
      for_each_wanted(store, detail, threads,
                      [&](unsigned) { return std::make_unique<Listed>(listed); });
      EXPECT_EQ(listed, expected) << threads << " threads";

      std::vector<stream::Point3> places, shown;
      for_each_wanted_point(store, detail,
                            [&](stream::ClusterId, const stream::ClusterPoints&, std::size_t,
                                const stream::Point3& place) { places.push_back(place); });
      for_each_wanted_place(store, detail, threads, [&](std::span<const stream::Point3> some) {
        shown.insert(shown.end(), some.begin(), some.end());
      });
      EXPECT_EQ(shown, places) << threads << " threads";
    }
  }
}

// Every point of a level and above belongs to one cluster of each level that is not finer.
TEST(StoreBuild, ClustersOfALevelPartitionFinerPoints) {
  const tests::TemporaryFolder folder;
  const stream::Store store =
      store_of_lines(folder.path(), "x,y,z,number", 20000, 50, [](std::ostream& file, int i) {
        file << i * 7919 % 10007 << ',' << i * 104729 % 10009 << ',' << i % 97 << ',' << i;
      });
  ASSERT_GE(store.top(), 2u);
  const auto numbers_of = [&](const Detail& detail) {
    std::vector<double> numbers;
    for_each_wanted_point(store, detail,
                          [&](stream::ClusterId, const stream::ClusterPoints& of, std::size_t i,
                              const stream::Point3& place) {
                            numbers.push_back(store.schema().view<double>(of.payload, 0)[i]);
                            EXPECT_EQ(place[2], static_cast<int>(numbers.back()) % 97);
                          });
    return numbers;
  };
  for (unsigned level = 0; level <= store.top(); ++level) {
    for (unsigned finer = 0; finer <= level; ++finer) {
      SCOPED_TRACE(std::to_string(level) + " of " + std::to_string(finer));
      std::vector<double> expected = numbers_of({.level = finer}), met;
      std::uint64_t records = 0;
      for (std::uint64_t c = 0; c < store.levels()[level].clusters; ++c) {
        const stream::ClusterId id = stream::cluster_id(level, c);
        const Detail detail{.level = finer, .cluster = id};
        const std::vector<double> of = numbers_of(detail);
        if (finer == 0) {
          EXPECT_EQ(of.size(), store.record(id).summary.descendants);
        }
        met.insert(met.end(), of.begin(), of.end());
        for_each_wanted_record(store, detail,
                               [&](stream::ClusterId, const stream::ClusterRecord& record) {
                                 records += record.points;
                               });
      }
      // All except the representatives, which are members of coarser clusters.
      EXPECT_EQ(records + (level < store.top() ? store.levels()[level].clusters : 0), met.size());
      std::sort(expected.begin(), expected.end());
      std::sort(met.begin(), met.end());
      EXPECT_EQ(met, expected);
    }
  }
  EXPECT_THROW(numbers_of({.cluster = stream::cluster_id(store.top(), 1)}), UsageError);
  EXPECT_THROW(numbers_of({.cluster = stream::cluster_id(store.top() + 1, 0)}), UsageError);
  EXPECT_THROW(numbers_of({.level = 1, .cluster = stream::cluster_id(0, 0)}), UsageError);
}

}  // namespace
// An array in memory; heights, gradients and a profile of the plane through its points.
TEST(StoreBuild, AcceptsCallersSource) {
  const tests::TemporaryFolder folder;
  const auto plane = [](double x, double y) { return 2 + 0.25 * x - 0.5 * y; };
  std::vector<stream::Point3> points;
  for (int i = 0; i < 3000; ++i) {
    const double x = i * 7919 % 10007 / 16.0, y = i * 104729 % 10009 / 16.0;
    points.push_back({x, y, plane(x, y)});
  }
  stream::MemoryPoints columns;
  columns.info.files = {"<points>"};
  columns.info.coordinates[0].name = "x";
  columns.info.coordinates[1].name = "y";
  columns.info.coordinates[2].name = "z";
  columns.count = points.size();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    columns.coordinates[axis] = {reinterpret_cast<const std::byte*>(&points[0][axis]),
                                 std::ptrdiff_t{sizeof(stream::Point3)}};
  }
  BuildRequest request;
  request.open = [&columns](const stream::SourceOptions& options) {
    return stream::open_memory(columns, options);
  };
  request.store = folder.path() / "store";
  request.block_points = 500;
  EXPECT_EQ(build_store(request).points, points.size());
  const stream::Store store = stream::Store::open(request.store);
  EXPECT_EQ(store.points(), points.size());

  const std::vector<Point2> places{{100, 100}, {333.25, 47.5}, {512, 600}, {-1e6, 0}};
  const std::vector<GroundPoint> found = sample_places(store, places);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(found[i].height, plane(places[i][0], places[i][1]), 1e-9);
    EXPECT_NEAR(found[i].east, 0.25, 1e-9);
    EXPECT_NEAR(found[i].north, -0.5, 1e-9);
  }
  EXPECT_TRUE(std::isnan(found[3].height) && std::isnan(found[3].east));

  ProfileRequest line;
  line.line = {{100, 100}, {400, 500}};
  line.step = 50.0;
  std::vector<ProfilePoint> along;
  const ProfileOutcome outcome = profile(store, line, [&](std::span<const ProfilePoint> more) {
    along.insert(along.end(), more.begin(), more.end());
  });
  EXPECT_EQ(outcome.points, 11u);
  ASSERT_EQ(along.size(), 11u);
  for (std::size_t i = 0; i < along.size(); ++i) {
    EXPECT_NEAR(along[i].metres, 50.0 * static_cast<double>(i), 1e-6);
    EXPECT_NEAR(along[i].height, plane(along[i].place[0], along[i].place[1]), 1e-9);
  }
  line.line.pop_back();
  EXPECT_THROW(profile(store, line, [](std::span<const ProfilePoint>) {}), UsageError);

  columns.count = 0;
  request.replace = true;
  try {
    build_store(request);
    FAIL() << "a store without points";
  } catch (const stream::Error& error) {
    EXPECT_EQ(error.parts().file, "<points>");
  }
}

// Most of the work may remain when the last point is read, because blocks wait for every thread.
TEST(StoreBuild, StopsAfterLastPointWasRead) {
  const tests::TemporaryFolder folder;
  std::vector<stream::Point3> points;
  for (int i = 0; i < 3100; ++i) {
    points.push_back({i * 7919 % 10007 / 16.0, i * 104729 % 10009 / 16.0, i % 7 / 4.0});
  }
  stream::MemoryPoints columns;
  columns.info.files = {"<points>"};
  columns.count = points.size();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    columns.info.coordinates[axis].name = std::string(1, "xyz"[axis]);
    columns.coordinates[axis] = {reinterpret_cast<const std::byte*>(&points[0][axis]),
                                 std::ptrdiff_t{sizeof(stream::Point3)}};
  }
  BuildRequest request;
  // The source itself does not react to a stop.
  request.open = [&columns](const stream::SourceOptions&) {
    return stream::open_memory(columns, {});
  };
  request.order = stream::Order::stream;
  request.store = folder.path() / "store";
  request.block_points = 500;
  for (const unsigned threads : {1u, 4u}) {
    std::stop_source stop;
    Context context;
    context.threads = threads;
    context.stop = stop.get_token();
    context.progress = [&](const Progress& progress) {
      if (progress.count == points.size()) stop.request_stop();
    };
    EXPECT_THROW(build_store(request, context), stream::Stopped);
    EXPECT_TRUE(stop.stop_requested());
    EXPECT_FALSE(fs::exists(request.store));
  }
}

}  // namespace terrace::terrain
