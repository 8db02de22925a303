// SPDX-License-Identifier: GPL-3.0-or-later
// Compares contour lines of point stores, and of rasters above level 0, with the segments of every
// triangle of the full triangulation.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/geotiff_writer.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "cloud_case.hpp"
#include "contour/parts.hpp"
#include "focus_case.hpp"
#include "surface/store_window.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace {
namespace {

using terrain::Point2;
using Segment = std::tuple<std::int64_t, Point2, Point2>;
using Corners = std::array<stream::Point3, 3>;

stream::Store store_of(const std::filesystem::path& input, std::size_t block_points) {
  terrain::BuildRequest request;
  request.inputs = {input.string()};
  request.store = input.string() + ".store";
  request.block_points = block_points;  // small blocks give more clusters and levels
  request.facility_cost = 1.0;
  terrain::build_store(request);
  return stream::Store::open(request.store);
}

stream::Store cloud(const std::filesystem::path& folder, std::span<const stream::Point3> points) {
  const auto file = folder / "cloud.xyz";
  std::ofstream out(file);
  out.precision(17);
  for (const stream::Point3& p : points) out << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
  out.close();
  return store_of(file, 100);
}

/// Some thousand points around a lake, with duplicates. whole: heights are integers, many of them
/// at contour levels.
std::vector<stream::Point3> lake_shore(std::uint64_t seed, bool whole) {
  std::mt19937_64 random(seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<stream::Point3> points;
  while (points.size() < 3000) {
    stream::Point3 p{unit() * unit() * 1000 - 300, unit() * 500, 0};
    if (std::hypot(p[0], p[1] - 250) < 140) continue;
    p[2] = 20 * std::sin(p[0] / 50) + 15 * std::cos(p[1] / 70) + unit();
    if (whole) p = {std::floor(p[0] / 8), std::floor(p[1] / 8), std::floor(p[2] / 3) * 2};
    points.push_back(p);
    if (random() % 40 == 0) points.push_back({p[0], p[1], p[2] + 3 * unit()});
  }
  return points;
}

/// The full triangulation.
std::vector<Corners> triangles_of(const stream::Store& store, unsigned level) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  terrain::WindowPoints points;
  terrain::StoreWindow(store).points({{-kInfinity, -kInfinity}, {kInfinity, kInfinity}}, points,
                                     level);
  std::vector<Point2> places;
  for (const stream::Point3& p : points.positions) places.push_back({p[0], p[1]});
  tri::Delaunay2<double> whole;
  const std::vector<tri::VertexId> vertices = whole.build(places);
  const stream::Channel& z = store.schema().coordinates[2];
  std::vector<double> heights(whole.vertex_slots());
  // The first of several duplicates counts.
  for (std::size_t i = places.size(); i-- > 0;) {
    heights[tri::slot(vertices[i])] = points.positions[i][2] * z.scale + z.offset;
  }
  std::vector<Corners> triangles;
  for (const tri::TriangleId id : whole.all_triangles()) {
    Corners triangle{};
    for (std::size_t i = 0; i < 3; ++i) {
      const tri::VertexId vertex = whole.vertices(id)[i];
      const Point2 p = whole.point(vertex);
      triangle[i] = {p[0], p[1], heights[tri::slot(vertex)]};
    }
    triangles.push_back(triangle);
  }
  return triangles;
}

/// Cuts each triangle separately; the gradient puts higher ground on the left. Skips segments of
/// zero length. by_rows: as in terrain::ContourLevels.
std::multiset<Segment> segments_of(const std::vector<Corners>& triangles, double interval,
                                   const std::function<bool(const Corners&)>& wanted,
                                   bool by_rows = false) {
  // The intervals have at most one decimal, so the multiples do too.
  const auto height = [&](std::int64_t level) {
    return std::round(10 * interval * static_cast<double>(level)) / 10;
  };
  std::multiset<Segment> segments;
  for (const Corners& t : triangles) {
    if (!wanted(t)) continue;
    const auto [lowest, highest] = std::minmax({t[0][2], t[1][2], t[2][2]});
    for (auto level = static_cast<std::int64_t>(std::floor(lowest / interval)) - 1;
         height(level) < highest; ++level) {
      const double h = height(level);
      std::vector<Point2> ends;
      Point2 up{};
      for (std::size_t i = 0; i < 3; ++i) {
        stream::Point3 a = t[i], b = t[(i + 1) % 3];
        if (by_rows ? std::pair(b[1], b[0]) < std::pair(a[1], a[0]) : b < a) std::swap(a, b);
        if ((a[2] > h) == (b[2] > h)) continue;
        const double share = (h - a[2]) / (b[2] - a[2]);
        const Point2 step{b[0] - a[0], b[1] - a[1]};
        ends.push_back(share == 1 ? Point2{b[0], b[1]}
                                  : Point2{a[0] + share * step[0], a[1] + share * step[1]});
        up[0] += b[2] > a[2] ? step[0] : -step[0];
        up[1] += b[2] > a[2] ? step[1] : -step[1];
      }
      if (ends.empty() || ends[0] == ends[1]) continue;
      const double left = up[1] * (ends[1][0] - ends[0][0]) - up[0] * (ends[1][1] - ends[0][1]);
      if (left < 0) std::swap(ends[0], ends[1]);
      segments.insert({level, ends[0], ends[1]});
    }
  }
  return segments;
}

std::vector<terrain::ContourLine> lines_of(const stream::Store& store,
                                           const terrain::ContourRequest& request,
                                           std::uint64_t points_per_part, unsigned threads = 1,
                                           std::uint64_t memory_bytes = std::uint64_t{1} << 30) {
  std::vector<terrain::ContourLine> lines;
  terrain::draw_point_contours(
      {.store = store,
       .request = request,
       .threads = threads,
       .memory_bytes = memory_bytes,
       .emit = [&](const terrain::ContourLine& line) { lines.push_back(line); },
       .limit = {},
       .progress = [](double) {},
       .points_per_part = points_per_part});
  return lines;
}

/// Checks that the lines match the full triangulation, in the same order for any number of threads
/// and any memory.
void expect_contours(const stream::Store& store, const terrain::ContourRequest& request,
                     const std::vector<Corners>& triangles, bool by_rows = false) {
  const auto wanted = [&](const Corners& t) {
    for (std::size_t i = 0; request.max_edge && i < 3; ++i) {
      const stream::Point3 &a = t[i], &b = t[(i + 1) % 3];
      if (std::hypot(a[0] - b[0], a[1] - b[1]) > *request.max_edge) return false;
    }
    const stream::Point3 middle{(t[0][0] + t[1][0] + t[2][0]) / 3,
                                (t[0][1] + t[1][1] + t[2][1]) / 3, 0};
    return !request.region || request.region->contains(middle);
  };
  const auto expected = segments_of(triangles, request.interval, wanted, by_rows);
  for (const std::uint64_t most : {1u << 20, 900u, 70u}) {
    SCOPED_TRACE("parts of " + std::to_string(most));
    const std::vector<terrain::ContourLine> lines = lines_of(store, request, most);
    std::multiset<Segment> segments;
    for (const terrain::ContourLine& line : lines) {
      if (line.closed) {
        EXPECT_EQ(line.points.front(), line.points.back());
      }
      for (std::size_t i = 0; i + 1 < line.points.size(); ++i) {
        segments.insert({line.level, line.points[i], line.points[i + 1]});
      }
    }
    EXPECT_EQ(segments.size(), expected.size());
    EXPECT_TRUE(segments == expected);
    const std::vector<terrain::ContourLine> again =
        lines_of(store, request, most, 3, std::uint64_t{64} << 20);
    ASSERT_EQ(again.size(), lines.size());
    for (std::size_t i = 0; i < lines.size(); ++i) EXPECT_EQ(again[i].points, lines[i].points);
  }
}

TEST(PointContours, MatchTheFullTriangulationAtAnyLevel) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const tests::TemporaryFolder folder;
    const stream::Store store = cloud(folder.path(), lake_shore(seed, seed % 2 == 0));
    for (unsigned level = 0; level <= std::min(2U, store.top()); ++level) {
      SCOPED_TRACE("level " + std::to_string(level));
      const std::vector<Corners> triangles = triangles_of(store, level);
      ASSERT_FALSE(triangles.empty());
      expect_contours(store, {.interval = seed % 2 == 0 ? 2.0 : 3.3, .level = level}, triangles);
    }
  }
}

TEST(PointContours, MatchTheFullTriangulationAlongAWindingSwath) {
  const tests::TemporaryFolder folder;
  const stream::Store store = cloud(folder.path(), tests::points_of("winding"));
  expect_contours(store, {.interval = 2}, triangles_of(store, 0));
}

TEST(PointContours, EndAtTrianglesWithTooLongASide) {
  const tests::TemporaryFolder folder;
  const stream::Store store = cloud(folder.path(), lake_shore(6, false));
  const std::vector<Corners> triangles = triangles_of(store, 0);
  for (const double most : {0.5, 12.0, 40.0, 1e6}) {
    SCOPED_TRACE(most);
    expect_contours(store, {.interval = 3, .max_edge = most}, triangles);
  }
  expect_contours(store,
                  {.interval = 3, .max_edge = 20, .region = terrain::Region::parse("0,0,200,400")},
                  triangles);
}

TEST(PointContours, OfARegionCrossTheTrianglesCentredInside) {
  const tests::TemporaryFolder folder;
  const stream::Store store = cloud(folder.path(), lake_shore(9, false));
  const std::vector<Corners> triangles = triangles_of(store, 0);
  std::mt19937_64 random(10);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::size_t strange = 0;
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(i);
    // Every second region is around the centroid of a large triangle, far from its corners.
    double x = unit() * 900 - 300, y = unit() * 450, size = 20 + 150 * unit();
    if (i % 2 == 0) {
      const auto area = [](const Corners& t) {
        return (t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) -
               (t[1][1] - t[0][1]) * (t[2][0] - t[0][0]);
      };
      std::vector<Corners> large = triangles;
      std::partial_sort(large.begin(), large.begin() + 40, large.end(),
                        [&](const Corners& s, const Corners& t) { return area(s) > area(t); });
      const Corners& t = large[random() % 40];
      size = 0.01;
      x = (t[0][0] + t[1][0] + t[2][0]) / 3 - size / 2;
      y = (t[0][1] + t[1][1] + t[2][1]) / 3 - size / 2;
    }
    const std::string text = std::to_string(x) + ',' + std::to_string(y) + ',' +
                             std::to_string(x + size) + ',' + std::to_string(y + size);
    const terrain::Region region = terrain::Region::parse(text);
    for (const Corners& t : triangles) {
      strange += i % 2 == 0 && region.contains({(t[0][0] + t[1][0] + t[2][0]) / 3,
                                                (t[0][1] + t[1][1] + t[2][1]) / 3, 0})
                     ? 1
                     : 0;
    }
    expect_contours(store, {.interval = 0.5, .region = region}, triangles);
  }
  EXPECT_GE(strange, 6u);
  const terrain::Region polygon = terrain::Region::of_polygons(
      {{{{-200, 10}, {400, 60}, {90, 480}}, {{0, 200}, {60, 200}, {30, 260}}}}, -1e9, 1e9);
  expect_contours(store, {.interval = 2, .region = polygon}, triangles);
  EXPECT_THROW(
      lines_of(store, {.interval = 1, .region = terrain::Region::parse("2000,0,2001,5")}, 100),
      stream::Error);
}

TEST(PointContours, MatchTheSamplesOfACoarserRasterLevel) {
  const tests::TemporaryFolder folder;
  stream::GeoTiffOptions options;
  options.columns = 90;
  options.rows = 70;
  options.sample.type = stream::ScalarType::i16;
  options.sample.scale = 0.5;
  options.sample.offset = -10;
  options.world.xy = {30, 0, 500000, 0, -30, 5200000};
  options.nodata = -32768;
  std::vector<std::int16_t> samples;
  for (std::uint32_t row = 0; row < options.rows; ++row) {
    for (std::uint32_t column = 0; column < options.columns; ++column) {
      const bool hole = std::hypot(column - 30.0, row - 40.0) < 12;
      samples.push_back(hole ? std::int16_t{-32768}
                             : static_cast<std::int16_t>(300 * std::sin(column / 20.0) +
                                                         200 * std::cos(row / 15.0)));
    }
  }
  const auto file = folder.path() / "dem.tif";
  stream::GeoTiffWriter writer(file, options);
  writer.write_rows(std::as_bytes(std::span(samples)));
  writer.commit();
  const stream::Store store = store_of(file, 200);
  ASSERT_GE(store.top(), 1u);
  const std::vector<Corners> triangles = triangles_of(store, 1);
  expect_contours(store, {.interval = 7, .level = 1}, triangles);
}

/// Returns the number of ends that lines have: places where one of the segments ends alone.
std::size_t ends_of(const std::multiset<Segment>& segments) {
  std::map<std::pair<std::int64_t, Point2>, int> balance;
  for (const auto& [level, from, to] : segments) {
    ++balance[{level, from}];
    --balance[{level, to}];
  }
  return static_cast<std::size_t>(std::count_if(balance.begin(), balance.end(),
                                                [](const auto& one) { return one.second != 0; }));
}

TEST(PointContours, OfMixedLevelsAreThoseOfTheMeshAndClosedAcrossLevels) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const tests::TemporaryFolder folder;
    const stream::Store store = cloud(folder.path(), lake_shore(seed, false));
    ASSERT_GE(store.top(), 1u);
    tests::Random random(seed);
    const terrain::Detail detail = tests::random_detail(store, random);
    const terrain::ContourRequest request{
        .interval = 3.3, .level = detail.level, .focuses = detail.focuses};
    const tests::FocusMesh mesh(store, detail);
    expect_contours(store, request, mesh.triangles);
    const auto lines = lines_of(store, request, 300);
    const auto open =
        std::count_if(lines.begin(), lines.end(), [](const auto& line) { return !line.closed; });
    const auto segments =
        segments_of(mesh.triangles, request.interval, [](const Corners&) { return true; });
    EXPECT_EQ(2 * static_cast<std::size_t>(open), ends_of(segments));
  }
}

TEST(PointContours, OfMixedLevelsOfARasterAreThoseOfLevel0InFocuses) {
  const tests::TemporaryFolder folder;
  const stream::Store store = stream::Store::open(tests::raster_store(folder.path()));
  std::vector<terrain::ContourLine> lattice;
  const terrain::ContourRequest fine{.interval = 50};
  terrain::draw_lattice_contours(
      {.store = store,
       .request = fine,
       .emit = [&](const terrain::ContourLine& line) { lattice.push_back(line); },
       .limit = {},
       .progress = [](double) {}});
  std::size_t inside = 0, left_out = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    tests::Random random(seed);
    terrain::Detail detail = tests::random_detail(store, random);
    // Around a part of the missing samples.
    if (seed == 1)
      detail.focuses.push_back({terrain::Region::parse("501000,5197500,503000,5199000"), 0});
    const terrain::ContourRequest request{
        .interval = 50, .level = detail.level, .focuses = detail.focuses};
    std::vector<Corners> triangles;
    for (const auto& [corners, heights] :
         tests::Whole(tests::FocusMesh(store, detail).points).triangles) {
      bool neighbours = true;
      Point2 middle{};
      for (std::size_t k = 0; k < 2; ++k) {
        const auto [low, high] = std::minmax({corners[0][k], corners[1][k], corners[2][k]});
        neighbours = neighbours && high - low <= 1;
        middle[k] = (corners[0][k] + corners[1][k] + corners[2][k]) / 3;
      }
      if (!neighbours && tests::is_in_full_detail(store, detail, middle, 1)) {
        ++left_out;
        continue;
      }
      Corners triangle{};
      for (std::size_t i = 0; i < 3; ++i) triangle[i] = {corners[i][0], corners[i][1], heights[i]};
      triangles.push_back(triangle);
    }
    expect_contours(store, request, triangles, true);
    std::multiset<Segment> segments;
    for (const terrain::ContourLine& line : lines_of(store, request, 900)) {
      for (std::size_t i = 0; i + 1 < line.points.size(); ++i) {
        segments.insert({line.level, line.points[i], line.points[i + 1]});
      }
    }
    for (const terrain::ContourLine& line : lattice) {
      for (std::size_t i = 0; i + 1 < line.points.size(); ++i) {
        if (!tests::is_in_full_detail(store, detail, line.points[i], 2)) continue;
        EXPECT_TRUE(segments.contains({line.level, line.points[i], line.points[i + 1]}));
        ++inside;
      }
    }
  }
  EXPECT_GT(inside, 0u);
  EXPECT_GT(left_out, 0u);
}

TEST(PointContours, AreEmptyForFewFlatAndCollinearPoints) {
  const std::vector<std::vector<stream::Point3>> clouds{
      {{1, 2, 3}},
      {{1, 2, 3}, {5, 9, 40}},
      {{7, 7, 1}, {7, 7, 30}, {7, 7, 60}},
      {{0, 0, 0}, {1, 1, 9}, {2, 2, 20}, {7, 7, 80}},
      {{0, 0, 10}, {1, 0, 10}, {0, 1, 10}, {1, 1, 10}, {3, 3, 10}},
  };
  for (const auto& points : clouds) {
    const tests::TemporaryFolder folder;
    const stream::Store store = cloud(folder.path(), points);
    for (const double interval : {10.0, 1e-3, 1e9}) {
      EXPECT_TRUE(lines_of(store, {.interval = interval}, 2).empty());
    }
  }
  const tests::TemporaryFolder folder;
  const stream::Store one =
      cloud(folder.path(), std::vector<stream::Point3>{{0, 0, 0}, {1, 0, 10}, {0, 1, 10}});
  expect_contours(one, {.interval = 4}, triangles_of(one, 0));
  // At 4 and 8; the level 0 touches only the corner.
  EXPECT_EQ(lines_of(one, {.interval = 4}, 2).size(), 2u);
}

TEST(PointContours, RejectsMoreLevelsThanFitIntoMemory) {
  const tests::TemporaryFolder folder;
  const stream::Store store =
      cloud(folder.path(), std::vector<stream::Point3>{{0, 0, 0}, {1, 0, 10}, {0, 1, 10}});
  terrain::ContourRequest request{.interval = 1e-9};
  EXPECT_THROW(
      terrain::draw_point_contours(
          {.store = store,
           .request = request,
           .emit = [](const terrain::ContourLine&) {},
           .limit = {.points = 10000,
                     .exceeded = [] { throw stream::Error({.file = "", .cause = "many"}); }},
           .progress = [](double) {}}),
      stream::Error);
}

}  // namespace
}  // namespace terrace
