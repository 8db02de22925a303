// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/merge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/memory_source.hpp>
#include <terrace/stream/source.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/error.hpp"
#include "test_raster.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

/// A point in the CRS, with its attributes.
using Point = std::pair<stream::Point3, std::vector<std::byte>>;

std::vector<Point> points_of(const stream::Store& store) {
  std::vector<Point> points;
  const std::size_t bytes = store.schema().payload_size();
  for (unsigned level = 0; level <= store.top(); ++level) {
    store.for_each(level, [&](stream::ClusterId, const auto&, const stream::ClusterPoints& p) {
      for (std::size_t i = 0; i < p.size(); ++i) {
        const auto payload = p.payload.begin() + static_cast<std::ptrdiff_t>(i * bytes);
        points.push_back({world_point(store.schema(), p.positions[i]),
                          {payload, payload + static_cast<std::ptrdiff_t>(bytes)}});
      }
    });
  }
  std::sort(points.begin(), points.end());
  return points;
}

void expect_sound(const stream::Store& store) {
  std::string problems;
  EXPECT_TRUE(store.verify([&](const stream::Problem& p) { problems += p.what + "\n"; }));
  EXPECT_EQ(problems, "");
}

class Merge : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kColumns = 90, kRows = 70;

  static double height(std::uint32_t column, std::uint32_t row) {
    if ((column * 7 + row * 13) % 31 == 0) return -9999;
    return std::round(300 + 80 * std::sin(column / 9.0) + 3 * row);
  }

  /// Builds a store of a window of the raster.
  stream::Store window(
      const std::string& name, std::array<std::uint32_t, 4> box,
      const std::function<void(stream::GeoTiffOptions&, BuildRequest&)>& edit = {}) {
    stream::GeoTiffOptions options;
    options.nodata = -9999;
    options.columns = box[2] - box[0];
    options.rows = box[3] - box[1];
    options.world.xy = {30, 0, 500000 + 30.0 * box[0], 0, -30, 5000000 - 30.0 * box[1]};
    options.crs.epsg = 32632;
    BuildRequest request{.store = folder_.path() / name};
    request.block_points = 200;
    if (edit) edit(options, request);
    const fs::path file = folder_.path() / (name + ".tif");
    tests::write_test_raster(file, options, [&](std::uint32_t column, std::uint32_t row) {
      return height(box[0] + column, box[1] + row);
    });
    request.inputs = {file.string()};
    build_store(request);
    return stream::Store::open(request.store);
  }

  /// Builds a store of points with an attribute.
  stream::Store cloud(const std::string& name, const std::vector<stream::Point3>& points,
                      const std::function<void(BuildRequest&)>& edit = {}) {
    const fs::path path = folder_.path() / (name + ".csv");
    {
      std::ofstream file(path);
      file.precision(17);
      file << "x,y,z,number\n";
      for (std::size_t i = 0; i < points.size(); ++i) {
        file << points[i][0] << ',' << points[i][1] << ',' << points[i][2] << ',' << i % 7 << '\n';
      }
    }
    BuildRequest request{.inputs = {path.string()}, .store = folder_.path() / name};
    request.block_points = 60;
    if (edit) edit(request);
    build_store(request);
    return stream::Store::open(request.store);
  }

  MergeOutcome merge(std::vector<fs::path> stores, const std::string& name) {
    return merge_stores({.stores = std::move(stores), .store = folder_.path() / name});
  }
  stream::Store open(const std::string& name) { return stream::Store::open(folder_.path() / name); }
  /// Returns the message of the error of merging two stores.
  std::string refusal(const stream::Store& a, const stream::Store& b) {
    try {
      merge({a.path(), b.path()}, "refused");
    } catch (const stream::Error& error) {
      EXPECT_FALSE(fs::exists(folder_.path() / "refused"));
      return error.what();
    }
    return "merged";
  }

  tests::TemporaryFolder folder_;
};

TEST_F(Merge, HasTheSamplesOfTheWholeRaster) {
  const stream::Store whole = window("whole", {0, 0, kColumns, kRows});
  // In several sizes; the smallest one fits a block, so its only level is 0.
  const stream::Store a = window("a", {0, 0, 40, kRows}), b = window("b", {40, 0, kColumns, 30}),
                      c = window("c", {40, 30, kColumns, 66}),
                      d = window("d", {40, 66, kColumns, kRows});
  EXPECT_EQ(d.top(), 0u);
  const MergeOutcome outcome = merge({c.path(), a.path(), d.path(), b.path()}, "merged");
  const stream::Store merged = open("merged");
  expect_sound(merged);
  EXPECT_EQ(points_of(merged), points_of(whole));
  EXPECT_EQ(outcome.points, whole.points());
  EXPECT_EQ(merged.points(), whole.points());
  EXPECT_EQ(merged.schema().nodata, whole.schema().nodata);
  EXPECT_EQ(merged.schema().columns, kColumns);
  EXPECT_EQ(merged.schema().rows, kRows);
  EXPECT_EQ(merged.schema().world.xy, whole.schema().world.xy);
  EXPECT_EQ(merged.bounds(), whole.bounds());
  EXPECT_NEAR(merged.mean_height(), whole.mean_height(), 1e-9);
  EXPECT_GE(outcome.segments, 5u);
  EXPECT_EQ(outcome.clusters,
            a.levels()[0].clusters + b.levels()[0].clusters + c.levels()[0].clusters);
  EXPECT_GT(merged.levels()[0].clusters, outcome.clusters);  // those of the smallest one are new
  // The order of the stores does not matter.
  merge({a.path(), b.path(), c.path(), d.path()}, "again");
  EXPECT_EQ(open("again").checksum(), merged.checksum());
}

TEST_F(Merge, OfMergedStores) {
  const stream::Store whole = window("whole", {0, 0, kColumns, kRows});
  const stream::Store a = window("a", {50, 0, kColumns, kRows}), b = window("b", {0, 0, 25, kRows}),
                      c = window("c", {25, 0, 50, kRows});
  // The first of them has its cells to the right of those that come later, so it is shifted twice.
  merge({a.path(), c.path()}, "ac");
  merge({(folder_.path() / "ac"), b.path()}, "abc");
  const stream::Store merged = open("abc");
  expect_sound(merged);
  EXPECT_EQ(points_of(merged), points_of(whole));
  // Its parts may be removed: the store has its own files.
  for (const char* part : {"a", "b", "c", "ac"}) fs::remove_all(folder_.path() / part);
  expect_sound(open("abc"));
  // A copy with one segment per level.
  stream::repack(merged, folder_.path() / "packed");
  const stream::Store packed = open("packed");
  expect_sound(packed);
  EXPECT_EQ(points_of(packed), points_of(whole));
  for (const stream::LevelInfo& level : packed.levels()) EXPECT_EQ(level.segments, 1u);
}

TEST_F(Merge, HasAllPointsOfClouds) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    std::vector<fs::path> paths;
    std::vector<Point> all;
    const std::size_t parts = 2 + random() % 5;
    for (std::size_t part = 0; part < parts; ++part) {
      const std::size_t sizes[] = {1, 2 + random() % 59, 61 + random() % 200, 3000};
      std::vector<stream::Point3> points(sizes[random() % 4]);
      for (stream::Point3& p : points) {
        for (double& c : p) c = static_cast<double>(random() % 1000) / 8;
        p[0] += 100.0 * static_cast<double>(part % 3);
      }
      const std::string name = "s" + std::to_string(seed) + "-" + std::to_string(part);
      const stream::Store store = cloud(name, points);
      paths.push_back(store.path());
      const std::vector<Point> stored = points_of(store);
      all.insert(all.end(), stored.begin(), stored.end());
    }
    std::sort(all.begin(), all.end());
    const std::string name = "merged" + std::to_string(seed);
    merge(paths, name);
    const stream::Store merged = open(name);
    expect_sound(merged);
    EXPECT_EQ(points_of(merged), all);
    // Queries, which use the boxes in the index, agree with a scan.
    stream::StoreQuery query(merged);
    for (int i = 0; i < 20; ++i) {
      stream::Box3 box;
      for (int corner = 0; corner < 2; ++corner) {
        stream::Point3 p;
        for (double& c : p) c = static_cast<double>(random() % 3000) / 8;
        box.include(p);
      }
      const auto expected = std::count_if(all.begin(), all.end(),
                                          [&](const Point& p) { return box.contains(p.first); });
      EXPECT_EQ(query.in_box(box).size(), static_cast<std::size_t>(expected));
    }
  }
}

TEST_F(Merge, KeepsTheSignOfZero) {
  std::vector<fs::path> paths;
  for (const char* name : {"a", "b"}) {
    std::vector<stream::Point3> points;
    for (int i = 0; i < 400; ++i) points.push_back({-0.0, -0.0, *name - 95.0 + i});
    paths.push_back(cloud(name, points).path());
  }
  merge(paths, "merged");
  cloud("merged", {{-0.0, -0.0, -0.0}}, [](BuildRequest& request) { request.append = true; });
  const stream::Store merged = open("merged");
  expect_sound(merged);
  std::size_t negative = 0;
  for (unsigned level = 0; level <= merged.top(); ++level) {
    merged.for_each(level, [&](stream::ClusterId, const auto&, const stream::ClusterPoints& p) {
      for (const stream::Point3& at : p.positions) {
        negative += std::signbit(at[0]) && std::signbit(at[1]);
      }
    });
  }
  EXPECT_EQ(negative, 801u);
}

TEST_F(Merge, ShiftsIntegersOfDifferentOffsets) {
  // Laser points whose headers count from different corners.
  const auto las = [&](const std::string& name, double offset, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<std::int32_t> columns(3000);
    for (std::int32_t& c : columns) c = static_cast<std::int32_t>(random() % 20000);
    BuildRequest request{.store = folder_.path() / name};
    request.block_points = 60;
    request.open = [&](const stream::SourceOptions& options) {
      stream::MemoryPoints points;
      points.count = columns.size() / 3;
      points.info.files = {name};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        stream::Channel& channel = points.info.coordinates[axis];
        channel.type = stream::ScalarType::i32;
        if (axis == 2) channel.scale = 0.01, channel.offset = offset / 10;
        points.coordinates[axis] = {reinterpret_cast<const std::byte*>(&columns[axis]),
                                    3 * sizeof(std::int32_t)};
      }
      points.info.world.xy = {0.01, 0, offset, 0, 0.01, 2 * offset};
      return stream::open_memory(points, options);
    };
    build_store(request);
    return stream::Store::open(request.store);
  };
  const stream::Store a = las("a", 500000, 1), b = las("b", 500100, 2),
                      odd = las("odd", 500000.004, 3);
  merge({b.path(), a.path()}, "merged");
  const stream::Store merged = open("merged");
  expect_sound(merged);
  std::vector<Point> all = points_of(a);
  const std::vector<Point> of_b = points_of(b);
  all.insert(all.end(), of_b.begin(), of_b.end());
  std::sort(all.begin(), all.end());
  const std::vector<Point> found = points_of(merged);
  ASSERT_EQ(found.size(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(found[i].first[axis], all[i].first[axis], 1e-9);
    }
  }
  EXPECT_NE(refusal(a, odd).find("the scales or offsets of their coordinates differ"),
            std::string::npos);
}

TEST_F(Merge, RefusesStoresThatDoNotFit) {
  const stream::Store a = window("a", {0, 0, 40, kRows});
  const auto expect = [&](const std::string& name, std::array<std::uint32_t, 4> box,
                          const std::string& cause, const auto& edit) {
    const std::string text = refusal(a, window(name, box, edit));
    EXPECT_NE(text.find(cause), std::string::npos) << text;
    EXPECT_NE(text.find((folder_.path() / "a").string()), std::string::npos) << text;
    EXPECT_NE(text.find((folder_.path() / name).string()), std::string::npos) << text;
  };
  const std::array<std::uint32_t, 4> next{40, 0, kColumns, kRows};
  expect("crs", next, "the CRS is", [](auto& options, auto&) { options.crs.epsg = 32633; });
  expect("vertical", next, "heights are",
         [](auto&, auto& request) { request.vertical = "ellipsoidal"; });
  expect("facility", next, "facility_cost",
         [](auto&, auto& request) { request.facility_cost = 5; });
  expect("metric", next, "metric squared",
         [](auto&, auto& request) { request.metric = MetricChoice::parse("squared"); });
  expect("half", next, "do not line up", [](auto& options, auto&) { options.world.xy[2] += 15; });
  expect("large", next, "do not line up",
         [](auto& options, auto&) { options.world.xy[0] = 30.01; });
  expect("overlap", {39, 0, kColumns, kRows}, "both have a value for the cell",
         [](auto&, auto&) {});
  const stream::Store points = cloud("points", {{1, 2, 3}, {4, 5, 6}});
  EXPECT_NE(refusal(a, points).find("a raster, the other is"), std::string::npos);
  EXPECT_NE(refusal(a, a).find("is the same store"), std::string::npos);
  EXPECT_THROW(merge({a.path()}, "one"), UsageError);
  // Another seed does not matter, nor are cells without data in the other's.
  const stream::Store seed = window("seed", next, [](auto&, auto& request) { request.seed = 99; });
  merge({a.path(), seed.path()}, "merged");
  expect_sound(open("merged"));
}

TEST_F(Merge, ClustersAsTheStoresRecord) {
  std::ofstream(folder_.path() / "metric.json")
      << R"({"regions": [{"box": [0, 0, 100, 60], "semi_axes": [4, 1], "angle": 30},
                          {"box": [0, 60, 0, 90, 99, 50], "semi_axes": [1, 2, 3],
                           "rotation": [[0, 1, 0], [1, 0, 0], [0, 0, 1]]},
                          {"semi_axes": [1, 1.5], "angle": 0}]})";
  const std::string metric = "elliptical:" + (folder_.path() / "metric.json").string();
  const auto edits = {
      std::function<void(BuildRequest&)>(
          [&](BuildRequest& r) { r.metric = MetricChoice::parse(metric); }),
      std::function<void(BuildRequest&)>([](BuildRequest& r) {
        r.channels = {{"number", 2.5}};
        r.strategy = cluster::FacilityStrategy::full_scan;
        r.batch = 3;
        r.z_weight = 0.5;
        r.effort = cluster::Effort::fine;
      }),
      std::function<void(BuildRequest&)>([](BuildRequest& r) { r.outlier_price = 2; }),
      std::function<void(BuildRequest&)>([](BuildRequest& r) { r.k = 5; })};
  std::mt19937_64 random(4);
  int number = 0;
  for (const auto& edit : edits) {
    SCOPED_TRACE(number);
    const std::string name = std::to_string(number++);
    std::vector<fs::path> paths;
    std::vector<Point> all;
    for (const char* part : {"a", "b"}) {
      std::vector<stream::Point3> points(1200);
      for (stream::Point3& p : points) {
        for (double& c : p) c = static_cast<double>(random() % 1000) / 10;
      }
      const stream::Store store = cloud(part + name, points, edit);
      paths.push_back(store.path());
      const std::vector<Point> stored = points_of(store);
      all.insert(all.end(), stored.begin(), stored.end());
    }
    std::sort(all.begin(), all.end());
    merge(paths, "merged" + name);
    const stream::Store merged = open("merged" + name);
    expect_sound(merged);
    EXPECT_EQ(points_of(merged), all);
    EXPECT_EQ(merged.schema().parameters, stream::Store::open(paths[0]).schema().parameters);
  }
}

/// Returns the points of each cluster below the root, in the CRS.
std::vector<std::vector<stream::Point3>> clusters_of(const stream::Store& store, unsigned level,
                                                     std::uint64_t count) {
  std::vector<std::vector<stream::Point3>> clusters;
  stream::ClusterPoints points;
  for (std::uint64_t i = 0; i < count; ++i) {
    store.read(stream::cluster_id(level, i), points);
    std::vector<stream::Point3>& places = clusters.emplace_back();
    for (const stream::Point3& p : points.positions) {
      places.push_back(world_point(store.schema(), p));
    }
    places.push_back(world_point(store.schema(), points.representative));
  }
  return clusters;
}

TEST_F(Merge, AppendsWindowsOfARaster) {
  const stream::Store whole = window("whole", {0, 0, kColumns, kRows});
  window("store", {30, 0, 60, kRows});
  const auto append = [](auto&, BuildRequest& request) {
    request.store = request.store.parent_path() / "store";
    request.block_points = 10000;  // the default; the store's is 200
    request.append = true;
  };
  // To the east and, with a moved origin, to the west. Both repeat a column of the store.
  for (const auto& [name, box] :
       {std::pair("east", std::array<std::uint32_t, 4>{59, 0, kColumns, kRows}),
        std::pair("west", std::array<std::uint32_t, 4>{0, 0, 31, kRows})}) {
    SCOPED_TRACE(name);
    const stream::Store before = open("store");
    std::vector<std::vector<std::vector<stream::Point3>>> kept;
    for (unsigned l = 0; l < before.top(); ++l) {
      kept.push_back(clusters_of(before, l, before.levels()[l].clusters));
    }
    const std::vector<Point> points = points_of(before);
    const stream::Store late = open("store");  // which opens its segments later
    window(name, box, append);
    const stream::Store after = open("store");
    expect_sound(after);
    // The clusters keep their ids.
    for (unsigned l = 0; l < before.top(); ++l) {
      EXPECT_EQ(clusters_of(after, l, before.levels()[l].clusters), kept[l]);
    }
    // Readers keep the store that they have opened.
    EXPECT_EQ(points_of(before), points);
    EXPECT_EQ(points_of(late), points);
  }
  const stream::Store after = open("store");
  EXPECT_EQ(points_of(after), points_of(whole));
  EXPECT_EQ(after.schema().world.xy, whole.schema().world.xy);
  EXPECT_EQ(after.schema().columns, kColumns);
  for (const auto& entry : fs::directory_iterator(folder_.path())) {
    EXPECT_EQ(entry.path().filename().string().find(".tmp"), std::string::npos) << entry.path();
  }
}

TEST_F(Merge, AppendsCloudsOfAnySize) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::string name = "store" + std::to_string(seed);
    std::vector<stream::Point3> all;
    for (int part = 0; part < 5; ++part) {
      const std::size_t sizes[] = {1, 2 + random() % 59, 61 + random() % 200, 2500};
      std::vector<stream::Point3> points(sizes[random() % 4]);
      for (stream::Point3& p : points) {
        for (double& c : p) c = static_cast<double>(random() % 1000) / 8;
      }
      cloud(name, points, [&](BuildRequest& request) { request.append = part > 0; });
      all.insert(all.end(), points.begin(), points.end());
      const stream::Store store = open(name);
      expect_sound(store);
      std::vector<stream::Point3> found;
      for (const Point& point : points_of(store)) found.push_back(point.first);
      std::sort(all.begin(), all.end());
      EXPECT_EQ(found, all);
    }
  }
}

TEST_F(Merge, RefusesWhatCannotBeAppended) {
  window("store", {0, 0, 40, kRows});
  const std::uint32_t checksum = open("store").checksum();
  const auto refused = [&](const std::string& name, const auto& edit) -> std::string {
    try {
      window(name, {39, 0, kColumns, kRows}, [&](auto& options, BuildRequest& request) {
        request.store = folder_.path() / "store";
        request.append = true;
        edit(options, request);
      });
    } catch (const std::exception& error) {
      EXPECT_EQ(open("store").checksum(), checksum);
      return error.what();
    }
    return "appended";
  };
  int number = 0;
  const auto expect = [&](const std::string& cause, const auto& edit) {
    const std::string text = refused("part" + std::to_string(number++), edit);
    EXPECT_NE(text.find(cause), std::string::npos) << text;
  };
  expect("both have a value for the cell", [](auto& options, auto&) { options.world.xy[2] -= 30; });
  expect("do not line up", [](auto& options, auto&) { options.world.xy[2] += 10; });
  expect("the CRS is", [](auto& options, auto&) { options.crs.epsg = 32633; });
  expect("facility_cost is 3, not 5", [](auto&, auto& request) { request.facility_cost = 5; });
  expect("block is 200, not 300", [](auto&, auto& request) { request.block_points = 300; });
  expect("give either", [](auto&, auto& request) { request.replace = true; });
  expect("trial run", [](auto&, auto& request) { request.most_points = 100; });
  expect("there is no store here",
         [&](auto&, auto& request) { request.store = folder_.path() / "nowhere"; });
}

TEST_F(Merge, OfTwoAppendsAtTheSameTimeOneIsRefused) {
  window("store", {0, 0, 40, kRows});
  const auto append = [this](auto&, BuildRequest& request) {
    request.store = folder_.path() / "store";
    request.append = true;
  };
  try {
    window("slow", {40, 30, kColumns, kRows}, [&](auto& options, BuildRequest& request) {
      append(options, request);
      request.open = [&](const stream::SourceOptions& source) {
        // The store is open already.
        window("fast", {40, 0, kColumns, 30}, append);
        const std::vector<std::string> names{(folder_.path() / "slow.tif").string()};
        return stream::open_source(names, source);
      };
    });
    FAIL() << "an append was lost";
  } catch (const stream::Error& error) {
    EXPECT_NE(std::string(error.what()).find("another process changed the store"),
              std::string::npos)
        << error.what();
  }
  // Run again, it succeeds.
  window("again", {40, 30, kColumns, kRows}, append);
  expect_sound(open("store"));
  EXPECT_EQ(points_of(open("store")), points_of(window("whole", {0, 0, kColumns, kRows})));
}

}  // namespace
}  // namespace terrace::terrain
