// SPDX-License-Identifier: Apache-2.0 Compares contour lines of Delaunay triangulations, divided
// into parts or not, with the segments of every single triangle.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/tri/delaunay2.hpp>

#include "contour/triangles.hpp"

namespace terrace::terrain {
namespace {

using Triangle = ContourTriangles::Triangle;
using Segment = std::tuple<std::int64_t, Point2, Point2>;
using PlaneEdge = std::pair<Point2, Point2>;

struct Surface {
  std::vector<Triangle> triangles;
  std::vector<Point2> points;
  tri::Delaunay2<double> whole;  ///< the triangulation of these triangles, in order
  std::vector<double> heights;   ///< by vertex slot
};

/// Makes points in a square of side 100 at an offset. kind 0: anywhere; 1: integers, few heights;
/// 2: clustered; 3: all but one on a line.
Surface random_surface(std::uint64_t seed, int kind, std::size_t count, double interval) {
  std::mt19937_64 random(seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const double offset = seed % 2 == 0 ? 0 : 5e6;
  Surface surface;
  std::vector<double> heights;
  for (std::size_t i = 0; i < count; ++i) {
    Point2 p{100 * unit(), 100 * unit()};
    if (kind == 1) p = {std::floor(p[0] / 4), std::floor(p[1] / 4)};
    if (kind == 2) p = {50 + 50 * std::pow(p[0] / 50 - 1, 5), 50 + 50 * std::pow(p[1] / 50 - 1, 5)};
    if (kind == 3) p = {std::floor(p[0]), i == 0 ? 7.0 : 0.0};
    surface.points.push_back({p[0] + offset, p[1] + offset});
    const double height = 20 * std::sin(p[0] / 9) + 20 * std::cos(p[1] / 13) + 3 * unit();
    heights.push_back(kind == 1 ? std::floor(height / 8) * 4 : height);
  }
  tri::Delaunay2<double>& whole = surface.whole;
  const std::vector<tri::VertexId> vertices = whole.build(surface.points);
  std::vector<double>& height_of = surface.heights;
  height_of.resize(whole.vertex_slots());
  for (std::size_t i = count; i-- > 0;) height_of[tri::slot(vertices[i])] = heights[i];
  const ContourLevels levels(interval);
  for (const tri::TriangleId id : whole.all_triangles()) {
    Triangle triangle;
    for (std::size_t i = 0; i < 3; ++i) {
      const tri::VertexId vertex = whole.vertices(id)[i];
      const double height = height_of[tri::slot(vertex)];
      triangle[i] = {whole.point(vertex), height, levels.at_or_above(height), 0};
    }
    surface.triangles.push_back(triangle);
  }
  return surface;
}

/// Returns the segments of every single triangle, directed by the gradient, without those of zero
/// length.
std::multiset<Segment> segments_of(const std::vector<Triangle>& triangles, double interval) {
  // The intervals, and so the heights of their multiples, have at most one decimal.
  const auto height = [&](std::int64_t level) {
    return std::round(10 * interval * static_cast<double>(level)) / 10;
  };
  std::multiset<Segment> segments;
  for (const Triangle& t : triangles) {
    const double lowest = std::min({t[0].height, t[1].height, t[2].height});
    const double highest = std::max({t[0].height, t[1].height, t[2].height});
    for (auto level = static_cast<std::int64_t>(std::floor(lowest / interval)) - 1;
         height(level) < highest; ++level) {
      const double h = height(level);
      std::vector<Point2> ends;
      Point2 up{};
      for (std::size_t i = 0; i < 3; ++i) {
        ContourTriangles::Corner a = t[i], b = t[(i + 1) % 3];
        if (b.place < a.place) std::swap(a, b);
        if ((a.height > h) == (b.height > h)) continue;
        const double share = (h - a.height) / (b.height - a.height);
        ends.push_back(share == 1 ? b.place
                                  : Point2{a.place[0] + share * (b.place[0] - a.place[0]),
                                           a.place[1] + share * (b.place[1] - a.place[1])});
        const double sign = b.height > a.height ? 1 : -1;
        up[0] += sign * (b.place[0] - a.place[0]);
        up[1] += sign * (b.place[1] - a.place[1]);
      }
      if (ends.empty() || ends[0] == ends[1]) continue;
      const double left = up[1] * (ends[1][0] - ends[0][0]) - up[0] * (ends[1][1] - ends[0][1]);
      if (left < 0) std::swap(ends[0], ends[1]);
      segments.insert({level, ends[0], ends[1]});
    }
  }
  return segments;
}

struct DrawnParts {
  std::vector<ContourLine> lines;
  std::uint64_t max_open = 0, left_open = 0;
};

/// Divides the plane around the points into equal squares, numbered row by row.
struct Parts {
  Point2 low{};
  double size = 1;
  std::uint32_t across = 1;

  Parts(const std::vector<Point2>& points, std::uint32_t along) : low(points[0]), across(along) {
    Point2 high = low;
    for (const Point2& p : points) {
      for (std::size_t axis = 0; axis < 2; ++axis) {
        low[axis] = std::min(low[axis], p[axis]);
        high[axis] = std::max(high[axis], p[axis]);
      }
    }
    size = std::max(high[0] - low[0], high[1] - low[1]) * (1 + 1e-6) / along;
  }
  [[nodiscard]] std::uint32_t count() const { return across * across; }
  [[nodiscard]] std::uint32_t part_of(const Point2& p) const {
    return static_cast<std::uint32_t>((p[1] - low[1]) / size) * across +
           static_cast<std::uint32_t>((p[0] - low[0]) / size);
  }
};

DrawnParts draw(std::vector<Triangle> triangles, const Parts& parts, double interval) {
  std::vector<std::vector<Triangle>> by_part(parts.count());
  for (Triangle& t : triangles) {
    for (ContourTriangles::Corner& corner : t) corner.part = parts.part_of(corner.place);
    by_part[std::min({t[0].part, t[1].part, t[2].part})].push_back(t);
  }
  DrawnParts drawn;
  ContourTriangles contours(interval,
                            [&](const ContourLine& line) { drawn.lines.push_back(line); });
  for (std::vector<Triangle>& part : by_part) {
    ContourTriangles::sort(part);
    contours.add(part);
    drawn.max_open = std::max(drawn.max_open, contours.open_points());
  }
  drawn.left_open = contours.open_points();
  contours.finish();
  return drawn;
}

std::multiset<Segment> segments_of(const std::vector<ContourLine>& lines) {
  std::multiset<Segment> segments;
  for (const ContourLine& line : lines) {
    for (std::size_t i = 0; i + 1 < line.points.size(); ++i) {
      segments.insert({line.level, line.points[i], line.points[i + 1]});
    }
  }
  return segments;
}

TEST(ContourTriangles, MatchSegmentsOfTrianglesAndEndOnlyAtHull) {
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE(seed);
    const int kind = static_cast<int>(seed % 4);
    const double interval = kind == 1 ? 4 : 3.7;
    const Surface surface = random_surface(seed, kind, 60 + 40 * seed, interval);
    const auto expected = segments_of(surface.triangles, interval);
    ASSERT_FALSE(expected.empty());
    // Lines end at crossings of the hull.
    std::map<PlaneEdge, int> edges;
    for (const Triangle& t : surface.triangles) {
      for (std::size_t i = 0; i < 3; ++i) {
        ++edges[std::minmax(t[i].place, t[(i + 1) % 3].place)];
      }
    }
    std::map<Point2, double> height_of;
    for (const Triangle& t : surface.triangles) {
      for (const auto& corner : t) height_of[corner.place] = corner.height;
    }
    std::uint64_t ends = 0;
    for (const auto& [edge, count] : edges) {
      if (count != 1) continue;
      const ContourLevels levels(interval);
      const auto a = levels.at_or_above(height_of[edge.first]);
      const auto b = levels.at_or_above(height_of[edge.second]);
      ends += static_cast<std::uint64_t>(std::abs(a - b));
    }
    for (const std::uint32_t along : {1U, 3U, 9U}) {
      SCOPED_TRACE(std::to_string(along) + " parts along a side");
      const DrawnParts drawn = draw(surface.triangles, Parts(surface.points, along), interval);
      EXPECT_EQ(drawn.left_open, 0u);
      EXPECT_TRUE(segments_of(drawn.lines) == expected);
      std::uint64_t open = 0;
      for (const ContourLine& line : drawn.lines) {
        if (line.closed) {
          EXPECT_EQ(line.points.front(), line.points.back());
        } else {
          ++open;
        }
      }
      // With integer heights, lines may shrink to points, which are not written.
      EXPECT_LE(2 * open, ends);
      if (kind != 1) {
        EXPECT_EQ(2 * open, ends);
      }
    }
  }
}

/// As draw(), but uses a tracer for each part.
std::vector<ContourLine> trace(const Surface& surface, const Parts& parts, double interval,
                               const std::function<bool(tri::TriangleId)>& wanted) {
  const tri::Delaunay2<double>& whole = surface.whole;
  const ContourLevels levels(interval);
  std::vector<std::int64_t> level_of(whole.vertex_slots());
  std::vector<std::uint32_t> part_of(whole.vertex_slots());
  for (const tri::VertexId v : whole.all_vertices()) {
    level_of[tri::slot(v)] = levels.at_or_above(surface.heights[tri::slot(v)]);
    part_of[tri::slot(v)] = parts.part_of(whole.point(v));
  }
  std::vector<std::vector<tri::TriangleId>> by_part(parts.count());
  for (const tri::TriangleId id : whole.all_triangles()) {
    std::uint32_t part = kNoContourPart;
    std::set<std::int64_t> different;
    for (const tri::VertexId v : whole.vertices(id)) {
      part = std::min(part, part_of[tri::slot(v)]);
      different.insert(level_of[tri::slot(v)]);
    }
    if (different.size() > 1 && wanted(id)) by_part[part].push_back(id);
  }
  std::vector<ContourLine> lines;
  ContourTriangles contours(interval, [&](const ContourLine& line) { lines.push_back(line); });
  PartTracer tracer(levels, whole, surface.heights, level_of, part_of);
  for (const std::vector<tri::TriangleId>& part : by_part) contours.add(tracer.trace(part));
  EXPECT_EQ(contours.open_points(), 0u);
  contours.finish();
  return lines;
}

TEST(PartTracer, FindsLinesInSegmentOrder) {
  // Every kind, even if only a few are tested.
  constexpr std::uint64_t kStep = TERRACE_TEST_SHARE == 1 ? 1 : 5;
  for (std::uint64_t seed = 51; seed <= 74; seed += kStep) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const int kind = static_cast<int>(seed % 4);
    const double interval = seed % 3 == 0 ? 0.5 : kind == 1 ? 4 : 2;
    const Surface surface = random_surface(seed, kind, 60 + 40 * (seed - 50), interval);
    for (const std::uint64_t left_out : {1000000U, 10U, 2U}) {
      const auto wanted = [&](tri::TriangleId id) {
        return tri::slot(id) * 2654435761U % 1000003U % left_out != 0;
      };
      std::vector<Triangle> triangles;
      std::size_t at = 0;
      for (const tri::TriangleId id : surface.whole.all_triangles()) {
        if (wanted(id)) triangles.push_back(surface.triangles[at]);
        ++at;
      }
      for (const std::uint32_t along : {1U, 3U, 9U}) {
        SCOPED_TRACE(std::to_string(along) + " parts along a side");
        const Parts parts(surface.points, along);
        const DrawnParts drawn = draw(triangles, parts, interval);
        const std::vector<ContourLine> traced = trace(surface, parts, interval, wanted);
        ASSERT_EQ(traced.size(), drawn.lines.size());
        for (std::size_t i = 0; i < traced.size(); ++i) {
          ASSERT_EQ(traced[i].level, drawn.lines[i].level);
          ASSERT_EQ(traced[i].closed, drawn.lines[i].closed);
          ASSERT_EQ(traced[i].points, drawn.lines[i].points);
        }
      }
    }
  }
}

TEST(ContourTriangles, EndAtOmittedTriangles) {
  for (std::uint64_t seed = 41; seed <= 48; ++seed) {
    SCOPED_TRACE(seed);
    Surface surface = random_surface(seed, 0, 900, 2);
    std::mt19937_64 random(seed);
    std::erase_if(surface.triangles, [&](const Triangle&) { return random() % 10 == 0; });
    const DrawnParts drawn = draw(surface.triangles, Parts(surface.points, 5), 2);
    EXPECT_TRUE(segments_of(drawn.lines) == segments_of(surface.triangles, 2));
    EXPECT_EQ(drawn.left_open, 0u);
  }
}

TEST(ContourTriangles, EmitLinesAsSoonAsComplete) {
  const Surface surface = random_surface(7, 0, 4000, 1);
  const DrawnParts drawn = draw(surface.triangles, Parts(surface.points, 8), 1);
  std::uint64_t points = 0;
  for (const ContourLine& line : drawn.lines) points += line.points.size();
  EXPECT_LT(drawn.max_open, points / 2);
}

TEST(ContourTriangles, OrderDependsOnlyOnPlaces) {
  const Surface surface = random_surface(9, 1, 600, 4);
  std::vector<Triangle> shuffled = surface.triangles;
  std::mt19937_64 random(3);
  for (Triangle& t : shuffled) {
    std::rotate(t.begin(), t.begin() + static_cast<std::ptrdiff_t>(random() % 3), t.end());
  }
  for (std::size_t i = shuffled.size(); i > 1; --i)
    std::swap(shuffled[i - 1], shuffled[random() % i]);
  const Parts parts(surface.points, 4);
  const DrawnParts one = draw(surface.triangles, parts, 4), other = draw(shuffled, parts, 4);
  ASSERT_FALSE(one.lines.empty());
  ASSERT_EQ(one.lines.size(), other.lines.size());
  for (std::size_t i = 0; i < one.lines.size(); ++i) {
    EXPECT_EQ(one.lines[i].points, other.lines[i].points);
  }
}

TEST(ContourTriangles, RespectLimitOfOpenLines) {
  const Surface surface = random_surface(5, 0, 2000, 0.5);
  ContourTriangles contours(0.5, [](const ContourLine&) {}, {.points = 100, .exceeded = [] {
                                                               throw std::length_error("too many");
                                                             }});
  EXPECT_THROW(contours.add(surface.triangles), std::length_error);
}

TEST(ContourTriangles, DrawNoLineAroundPitAndOneAbovePlateau) {
  const ContourLevels levels(0.1);
  const auto corner = [&](double x, double y, double height) {
    return ContourTriangles::Corner{{x, y}, height, levels.at_or_above(height), 0};
  };
  // A fan of triangles around a vertex at 0.3, the decimal product of three and 0.1.
  const double pit = levels.height(3);
  std::vector<Triangle> fan;
  for (int i = 0; i < 6; ++i) {
    const double a = i, b = (i + 1) % 6;
    fan.push_back({corner(0.7, 0.9, pit), corner(0.7 + std::cos(a), 0.9 + std::sin(a), pit + 0.05),
                   corner(0.7 + std::cos(b), 0.9 + std::sin(b), pit + 0.04)});
  }
  std::vector<ContourLine> lines;
  ContourTriangles pits(0.1, [&](const ContourLine& line) { lines.push_back(line); });
  pits.add(fan);
  pits.finish();
  EXPECT_TRUE(lines.empty());
  ContourTriangles plateau(0.1, [&](const ContourLine& line) { lines.push_back(line); });
  const std::vector<Triangle> step{
      {corner(0, 0, pit), corner(1, 0, pit), corner(0, 1, pit)},
      {corner(1, 0, pit), corner(1, 1, pit + 0.05), corner(0, 1, pit)},
  };
  plateau.add(step);
  plateau.finish();
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0].level, 3);
  EXPECT_EQ(lines[0].points, (std::vector<Point2>{{0, 1}, {1, 0}}));
}

}  // namespace
}  // namespace terrace::terrain
