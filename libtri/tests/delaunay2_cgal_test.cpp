// SPDX-License-Identifier: GPL-3.0-or-later
// Uses CGAL's Delaunay_triangulation_2 as an oracle, including ties: it perturbs in the same order,
// so the sets of triangles must be equal for any input.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <gtest/gtest.h>

#include "delaunay2/access.hpp"
#include "points.hpp"

namespace terrace::tri {
namespace {

using Kernel2 = CGAL::Exact_predicates_inexact_constructions_kernel;
using Oracle2 = CGAL::Delaunay_triangulation_2<Kernel2>;
using Triangle = std::array<std::array<double, 2>, 3>;

Triangle rotated(Triangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

std::vector<Triangle> triangles_of(const Oracle2& oracle) {
  std::vector<Triangle> result;
  for (const auto& face : oracle.finite_face_handles()) {
    Triangle t;
    for (int i = 0; i < 3; ++i) {
      const auto& p = face->vertex(i)->point();
      t[static_cast<std::size_t>(i)] = {p.x(), p.y()};
    }
    result.push_back(rotated(t));
  }
  std::sort(result.begin(), result.end());
  return result;
}

template <class Coord>
std::vector<Triangle> triangles_of(const Delaunay2<Coord>& triangulation) {
  std::vector<Triangle> result;
  for (const TriangleId id : triangulation.all_triangles()) {
    Triangle t;
    const auto corners = triangulation.vertices(id);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto p = triangulation.point(corners[i]);
      t[i] = {static_cast<double>(p[0]), static_cast<double>(p[1])};
    }
    result.push_back(rotated(t));
  }
  std::sort(result.begin(), result.end());
  return result;
}

template <class Coord>
void expect_equal_to_cgal(const std::vector<std::array<Coord, 2>>& points) {
  Delaunay2<Coord> triangulation;
  triangulation.build(points);
  EXPECT_EQ(find_fault(triangulation), "");
  std::vector<Kernel2::Point_2> cgal_points;
  for (const auto& p : points)
    cgal_points.emplace_back(static_cast<double>(p[0]), static_cast<double>(p[1]));
  const Oracle2 oracle(cgal_points.begin(), cgal_points.end());
  EXPECT_EQ(triangulation.vertex_count(), oracle.number_of_vertices());
  EXPECT_TRUE(triangles_of(triangulation) == triangles_of(oracle));
}

template <class Coord>
class Delaunay2CgalTest : public ::testing::Test {};
using Coords = ::testing::Types<std::int32_t, double>;
TYPED_TEST_SUITE(Delaunay2CgalTest, Coords);

TYPED_TEST(Delaunay2CgalTest, SameTriangles) {
  for (const PointSet kind : kPointSets) {
    for (const std::size_t count :
         {3u, 10u, 200u, 20'000u / (TERRACE_TEST_SHARE * TERRACE_TEST_SHARE)}) {
      SCOPED_TRACE(name(kind) + " " + std::to_string(count));
      expect_equal_to_cgal(make_points<TypeParam>(kind, count, 31));
    }
  }
}

/// Compares signs of the kernel for doubles with exact rational arithmetic.
using Exact = CGAL::Exact_predicates_exact_constructions_kernel;
Exact::Point_2 exact(const std::array<double, 2>& p) { return {p[0], p[1]}; }

void expect_exact_signs(const std::array<double, 2>& a, const std::array<double, 2>& b,
                        const std::array<double, 2>& c, const std::array<double, 2>& d) {
  using Ours = planar::DoubleKernel;
  const int turn = CGAL::orientation(exact(a), exact(b), exact(c));
  ASSERT_EQ(Ours::orientation(a, b, c), turn);
  if (turn != 0) {
    const int side = CGAL::side_of_oriented_circle(exact(a), exact(b), exact(c), exact(d));
    ASSERT_EQ(Ours::in_circle(a, b, c, d), side);
  }
  ASSERT_EQ(Ours::compare_distance(a, b, c),
            static_cast<int>(CGAL::compare_distance_to_point(exact(a), exact(b), exact(c))));
}

TEST(DoubleKernel, SignsAreExact) {
  std::mt19937_64 random(5);
  for (int round = 0; round < 20'000; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    // Points on a small raster, moved far out, scaled, and perturbed in the last bits: from easy to
    // undecidable in doubles.
    const double scale = std::ldexp(1.0, static_cast<int>(random() % 500) - 250);
    const double offset = round % 3 == 0 ? 0 : std::ldexp(scale, static_cast<int>(random() % 50));
    std::array<std::array<double, 2>, 4> p;
    for (auto& point : p) {
      for (double& c : point) {
        c = offset + scale * static_cast<double>(random() % 16);
        if (random() % 4 == 0) c = std::nextafter(c, random() % 2 == 0 ? -1e300 : 1e300);
      }
    }
    expect_exact_signs(p[0], p[1], p[2], p[3]);
    if (HasFatalFailure()) return;
  }
}

TEST(DoubleKernel, SignsOfLargeAndNegativeIntegersAreExact) {
  std::mt19937_64 random(6);
  for (int round = 0; round < 20'000; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    // Few different coordinates, so that many points are collinear or cocircular, up to the sizes
    // at which they are exact.
    const double step = std::ldexp(1.0, static_cast<int>(random() % 32));
    const double middle =
        std::floor(std::ldexp(to_unit(random()) - 0.5, static_cast<int>(random() % 55)));
    std::array<std::array<double, 2>, 4> p;
    for (auto& point : p) {
      for (double& c : point) c = middle + step * (static_cast<double>(random() % 7) - 3);
    }
    expect_exact_signs(p[0], p[1], p[2], p[3]);
    if (HasFatalFailure()) return;
  }
}

// ---- Real files, if the environment names a folder ----------------------------------------------

std::filesystem::path data_folder() {
  const char* folder = std::getenv("TERRACE_DATA");
  return folder == nullptr ? std::filesystem::path() : std::filesystem::path(folder) / "delaunay";
}

std::string contents(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Reads all numbers of a text in pairs, with any separators.
std::vector<std::array<double, 2>> number_pairs(const std::string& text, std::size_t limit) {
  std::vector<std::array<double, 2>> points;
  std::vector<double> numbers;
  const char* at = text.c_str();
  while (*at != 0 && points.size() < limit) {
    char* end = nullptr;
    const bool starts_number = (*at >= '0' && *at <= '9') || *at == '-';
    const double value = starts_number ? std::strtod(at, &end) : 0;
    if (!starts_number || end == at) {
      ++at;
      continue;
    }
    at = end;
    numbers.push_back(value);
    if (numbers.size() < 2) continue;
    points.push_back({numbers[0], numbers[1]});
    numbers.clear();
  }
  return points;
}

TEST(Delaunay2RealFiles, SameTrianglesAsCgal) {
  if (data_folder().empty()) GTEST_SKIP() << "TERRACE_DATA is not set";
  std::size_t files = 0;
  for (const char* folder : {"cdt", "delaunator", "georust", "julia"}) {
    if (!std::filesystem::exists(data_folder() / folder)) continue;
    for (const auto& entry : std::filesystem::directory_iterator(data_folder() / folder)) {
      SCOPED_TRACE(entry.path().string());
      std::string text = contents(entry.path());
      std::size_t limit = 100'000;
      if (std::string(folder) == "cdt") {
        // The first line has the numbers of points and edges. The points follow.
        limit = static_cast<std::size_t>(std::strtoul(text.c_str(), nullptr, 10));
        text.erase(0, text.find('\n'));
      }
      const auto points = number_pairs(text, limit);
      if (points.empty()) continue;
      expect_equal_to_cgal(points);
      ++files;
    }
  }
  EXPECT_GT(files, 0u);
}

TEST(DoubleKernel, MatchesThePublishedSigns) {
  // A. Nanevski, G. Blelloch, R. Harper, "Automatic generation of staged geometric predicates",
  // doi:10.1145/507635.507662: lines of number, coordinates, sign.
  if (data_folder().empty()) GTEST_SKIP() << "TERRACE_DATA is not set";
  using Ours = planar::DoubleKernel;
  std::ifstream orientations(data_folder() / "predicates" / "orient2d.txt");
  double number = 0;
  std::array<std::array<double, 2>, 4> p;
  int sign = 0;
  std::size_t count = 0;
  while (orientations >> number >> p[0][0] >> p[0][1] >> p[1][0] >> p[1][1] >> p[2][0] >> p[2][1] >>
         sign) {
    ASSERT_EQ(Ours::orientation(p[0], p[1], p[2]), sign) << "line " << number;
    ++count;
  }
  std::ifstream circles(data_folder() / "predicates" / "incircle.txt");
  while (circles >> number >> p[0][0] >> p[0][1] >> p[1][0] >> p[1][1] >> p[2][0] >> p[2][1] >>
         p[3][0] >> p[3][1] >> sign) {
    if (Ours::orientation(p[0], p[1], p[2]) == 0) continue;
    ASSERT_EQ(Ours::in_circle(p[0], p[1], p[2], p[3]), sign) << "line " << number;
    ++count;
  }
  EXPECT_GT(count, 0u);
}

}  // namespace
}  // namespace terrace::tri
