// SPDX-License-Identifier: Apache-2.0
// Tetrahedra of scans, and of point sets that were difficult for other programs, from the data
// folder named by TERRACE_DATA.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "delaunay3_oracle.hpp"
#include "scan_file.hpp"

namespace terrace::tri {
namespace {

using DoublePoints = std::vector<std::array<double, 3>>;

class Delaunay3DataTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("TERRACE_DATA");
    if (folder == nullptr) GTEST_SKIP() << "TERRACE_DATA is not set";
    folder_ = folder;
  }

  /// Points of the scan, or empty if it does not exist.
  [[nodiscard]] DoublePoints scan(const std::string& name) const {
    std::ifstream file(folder_ / "scan" / name, std::ios::binary);
    if (!file) return {};
    DoublePoints all = name.ends_with(".obj") ? read_obj(file).points : read_ply(file).points;
    DoublePoints some;
    constexpr std::size_t kStep = TERRACE_TEST_SHARE * TERRACE_TEST_SHARE;
    for (std::size_t i = 0; i < all.size(); i += kStep) some.push_back(all[i]);
    return some;
  }

  std::filesystem::path folder_;
};

constexpr const char* kScans[] = {"armadillo_tm.ply", "bun_zipper.ply", "cow.obj",   "fandisk.obj",
                                  "lucy_100k.ply",    "spot.obj",       "teapot.obj"};

/// Rounds to a raster of this many bits over the longest side. Few bits make points equal, coplanar
/// and cospherical.
std::vector<std::array<std::int32_t, 3>> with_bits(const DoublePoints& points, unsigned bits) {
  double step = 0.0;
  auto result = quantised(points, step);
  for (auto& p : result) {
    for (auto& c : p) c >>= 24 - bits;
  }
  return result;
}

template <class Coord>
void expect_same_as_cgal(const std::vector<std::array<Coord, 3>>& points) {
  Delaunay3<Coord> triangulation;
  triangulation.build(points, 2);
  const auto cgal_points = to_cgal(points);
  expect_equal_to_cgal(triangulation, Oracle3(cgal_points.begin(), cgal_points.end()));
}

TEST_F(Delaunay3DataTest, ScansMatchCgal) {
  std::size_t scans = 0;
  for (const char* name : kScans) {
    SCOPED_TRACE(name);
    const DoublePoints points = scan(name);
    if (points.empty()) continue;
    ++scans;
    expect_same_as_cgal(points);
    expect_same_as_cgal(with_bits(points, 24));
    expect_same_as_cgal(with_bits(points, 6));
  }
  EXPECT_GT(scans, 0u);
}

TEST_F(Delaunay3DataTest, NumbersOfPointSetFilesMatchCgal) {
  constexpr std::size_t kMost = 10'000 / TERRACE_TEST_SHARE;
  std::size_t files = 0;
  for (const char* name : {"cdt", "delaunator", "georust", "julia"}) {
    const std::filesystem::path folder = folder_ / "delaunay" / name;
    if (!std::filesystem::exists(folder)) continue;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      SCOPED_TRACE(entry.path().string());
      std::ifstream file(entry.path(), std::ios::binary);
      std::ostringstream text;
      text << file.rdbuf();
      std::string numbers = text.str();
      for (char& c : numbers) {
        const bool is_number = (c >= '0' && c <= '9') || c == '-' || c == '.' || c == 'e';
        if (!is_number) c = ' ';
      }
      // Any three consecutive numbers are a point, whether they are coordinates, indices of edges
      // or anything else.
      std::istringstream words(numbers);
      std::string word;
      std::vector<double> values;
      while (words >> word && values.size() < 3 * kMost) {
        char* end = nullptr;
        const double value = std::strtod(word.c_str(), &end);
        if (*end == 0) values.push_back(value);
      }
      DoublePoints points;
      for (std::size_t i = 0; i + 2 < values.size(); i += 3) {
        points.push_back({values[i], values[i + 1], values[i + 2]});
      }
      if (points.empty()) continue;
      expect_same_as_cgal(points);
      ++files;
    }
  }
  EXPECT_GT(files, 0u);
}

template <class Coord>
void expect_no_history(const std::vector<std::array<Coord, 3>>& points, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Delaunay3<Coord> built;
  built.build(points);
  const std::uint64_t hash = built.hash();

  // In another order, in sets of all sizes.
  auto shuffled = points;
  for (std::size_t i = shuffled.size(); i > 1; --i) {
    std::swap(shuffled[i - 1], shuffled[random() % i]);
  }
  Delaunay3<Coord> grown;
  for (std::size_t done = 0; done < shuffled.size();) {
    const std::size_t size = std::min<std::size_t>(1 + random() % 5000, shuffled.size() - done);
    grown.insert(std::span(shuffled).subspan(done, size), {});
    done += size;
  }
  EXPECT_EQ(grown.hash(), hash);

  // Parts of space are removed and reinserted. The state in between is checked too.
  for (int round = 0; round < 3; ++round) {
    std::vector<VertexId> going;
    std::vector<std::array<Coord, 3>> removed, left;
    const std::size_t axis = random() % 3;
    const auto border = points[random() % points.size()][axis];
    for (const VertexId v : grown.all_vertices()) {
      const auto p = grown.point(v);
      const bool goes = round == 2 ? random() % 2 == 0 : p[axis] < border;
      if (goes) going.push_back(v);
      (goes ? removed : left).push_back(p);
    }
    grown.remove(std::span<const VertexId>(going));
    Delaunay3<Coord> remaining;
    remaining.build(left);
    EXPECT_EQ(grown.hash(), remaining.hash());
    EXPECT_EQ(grown.tetrahedron_count(), remaining.tetrahedron_count());
    grown.insert(removed, {});
    EXPECT_EQ(grown.hash(), hash);
  }
  EXPECT_EQ(find_fault(grown), "");
}

TEST_F(Delaunay3DataTest, ScansDoNotDependOnHistory) {
  std::uint64_t seed = 41;
  for (const char* name : kScans) {
    SCOPED_TRACE(name);
    const DoublePoints points = scan(name);
    if (points.empty()) continue;
    SCOPED_TRACE("seed " + std::to_string(++seed));
    expect_no_history(points, seed);
    expect_no_history(with_bits(points, 24), seed);
    expect_no_history(with_bits(points, 6), seed);
  }
}

TEST_F(Delaunay3DataTest, MatchesThePublishedSigns) {
  // A. Nanevski, G. Blelloch, R. Harper, "Automatic generation of staged geometric predicates",
  // doi:10.1145/507635.507662: lines of number, coordinates, sign; in a left-handed frame.
  using Ours = spatial::DoubleKernel;
  double number = 0;
  std::array<std::array<double, 3>, 5> p;
  int sign = 0;
  std::size_t count = 0;
  const auto read = [&](std::istream& file, std::size_t points) {
    file >> number;
    for (std::size_t i = 0; i < points; ++i) file >> p[i][0] >> p[i][1] >> p[i][2];
    return static_cast<bool>(file >> sign);
  };
  std::ifstream orientations(folder_ / "delaunay" / "predicates" / "orient3d.txt");
  for (; read(orientations, 4); ++count) {
    ASSERT_EQ(Ours::orientation(p[0], p[1], p[2], p[3]), -sign) << "line " << number;
  }
  std::ifstream spheres(folder_ / "delaunay" / "predicates" / "insphere.txt");
  for (; read(spheres, 5); ++count) {
    if (Ours::orientation(p[0], p[1], p[2], p[3]) == 0) continue;
    ASSERT_EQ(Ours::in_sphere(p[0], p[1], p[2], p[3], p[4]), -sign) << "line " << number;
  }
  EXPECT_GT(count, 0u);
}

}  // namespace
}  // namespace terrace::tri
