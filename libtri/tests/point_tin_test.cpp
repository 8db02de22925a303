// SPDX-License-Identifier: GPL-3.0-or-later
#include "terrace/tri/point_tin.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "delaunay2/double_kernel.hpp"
#include "points.hpp"

namespace terrace::tri {
namespace {

using planar::DoubleKernel;
using Place = std::array<double, 2>;

struct Cloud {
  std::vector<double> x, y, z;
  void add(double px, double py, double pz) {
    x.push_back(px);
    y.push_back(py);
    z.push_back(pz);
  }
  [[nodiscard]] std::size_t size() const { return x.size(); }
  [[nodiscard]] std::size_t places() const {
    std::set<Place> all;
    for (std::size_t i = 0; i < size(); ++i) all.insert({x[i] + 0.0, y[i] + 0.0});
    return all.size();
  }
};

PointTin make(const Cloud& cloud, const std::vector<Point3>& frame,
              const PointTinOptions& options) {
  return point_tin(cloud.x, cloud.y, cloud.z, frame, options);
}
TinErrors measure(const Cloud& cloud, const PointTin& tin) {
  return measure_surface(cloud.x, cloud.y, cloud.z, tin.vertices, tin.triangles);
}

double rough(double u, double v) {
  return 40 * std::sin(5 * u + 2 * v) + 25 * std::sin(11 * v - 3 * u) + 6 * std::sin(31 * u * v) +
         2 * std::sin(97 * u + 41 * v);
}

/// Heights by the place within the unit square of the cloud's box, with steps and noise.
Cloud make_cloud(PointSet kind, std::size_t count, std::uint64_t seed) {
  Cloud cloud;
  std::mt19937_64 random(seed);
  const auto points = make_points<double>(kind, count, seed);
  Place low = points[0];
  Place high = points[0];
  for (const auto& p : points) {
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  std::map<Place, double> heights;
  for (const auto& p : points) {
    const auto part = [&](std::size_t k) {
      return high[k] > low[k] ? (p[k] - low[k]) / (high[k] - low[k]) : 0;
    };
    const double height = rough(part(0), part(1)) + (part(0) > 0.7 ? 30 : 0) + to_unit(random());
    cloud.add(p[0], p[1], heights.emplace(p, height).first->second);
  }
  return cloud;
}

Place place_of(const PointTin& tin, std::uint32_t v) {
  return {tin.vertices[v][0], tin.vertices[v][1]};
}

/// Triangles counter-clockwise, every edge once in each direction but for a simple border; no
/// vertex twice or unused. Returns the border's edges.
std::set<std::array<std::uint32_t, 2>> check_mesh(const PointTin& tin) {
  EXPECT_EQ(tin.sample.size(), tin.vertices.size());
  std::set<std::array<std::uint32_t, 2>> edges;
  std::vector<bool> used(tin.vertices.size(), false);
  for (const auto& t : tin.triangles) {
    EXPECT_GT(
        DoubleKernel::orientation(place_of(tin, t[0]), place_of(tin, t[1]), place_of(tin, t[2])),
        0);
    for (std::size_t i = 0; i < 3; ++i) {
      used[t[i]] = true;
      EXPECT_TRUE(edges.insert({t[i], t[(i + 1) % 3]}).second) << "an edge has two left sides";
    }
  }
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0) << "unused vertices";
  std::set<std::array<std::uint32_t, 2>> border;
  for (const auto& e : edges)
    if (!edges.contains({e[1], e[0]})) border.insert(e);
  // Euler: a disc.
  if (!tin.triangles.empty()) {
    EXPECT_EQ(tin.triangles.size(), 2 * tin.vertices.size() - 2 - border.size());
  }
  return border;
}

void check_delaunay(const PointTin& tin) {
  for (const auto& t : tin.triangles) {
    for (std::uint32_t v = 0; v < tin.vertices.size(); ++v) {
      if (v == t[0] || v == t[1] || v == t[2]) continue;
      ASSERT_LE(DoubleKernel::in_circle(place_of(tin, t[0]), place_of(tin, t[1]),
                                        place_of(tin, t[2]), place_of(tin, v)),
                0);
    }
  }
}

/// Every sample in every triangle, by another formula than the library's.
TinErrors brute_force(const Cloud& cloud, const PointTin& tin) {
  TinErrors result;
  double squares = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Place p{cloud.x[i], cloud.y[i]};
    bool found = false;
    for (const auto& t : tin.triangles) {
      const Place a = place_of(tin, t[0]);
      const Place b = place_of(tin, t[1]);
      const Place c = place_of(tin, t[2]);
      if (DoubleKernel::orientation(a, b, p) < 0 || DoubleKernel::orientation(b, c, p) < 0 ||
          DoubleKernel::orientation(c, a, p) < 0)
        continue;
      const long double det = (static_cast<long double>(b[0]) - a[0]) * (c[1] - a[1]) -
                              (static_cast<long double>(b[1]) - a[1]) * (c[0] - a[0]);
      const long double u = ((static_cast<long double>(p[0]) - a[0]) * (c[1] - a[1]) -
                             (static_cast<long double>(p[1]) - a[1]) * (c[0] - a[0])) /
                            det;
      const long double v = ((static_cast<long double>(b[0]) - a[0]) * (p[1] - a[1]) -
                             (static_cast<long double>(b[1]) - a[1]) * (p[0] - a[0])) /
                            det;
      const long double height = tin.vertices[t[0]][2] +
                                 u * (tin.vertices[t[1]][2] - tin.vertices[t[0]][2]) +
                                 v * (tin.vertices[t[2]][2] - tin.vertices[t[0]][2]);
      const auto error = static_cast<double>(std::abs(height - cloud.z[i]));
      result.largest = std::max(result.largest, error);
      squares += error * error;
      found = true;
      break;
    }
    ++(found ? result.covered : result.uncovered);
  }
  if (result.covered > 0) result.rms = std::sqrt(squares / static_cast<double>(result.covered));
  return result;
}

constexpr PointTinQuality kQualities[] = {PointTinQuality::kGreedy, PointTinQuality::kRemoval,
                                          PointTinQuality::kFitted};

TEST(PointTin, KeepsTheErrorOverTheHull) {
  for (const PointSet kind : kPointSets) {
    if (kind == PointSet::kHuge || kind == PointSet::kTiny) continue;
    for (const std::uint64_t seed : {1u, 2u}) {
      const Cloud cloud = make_cloud(kind, 800, seed);
      for (const double error : {0.0, 0.5, 5.0, 200.0}) {
        for (const PointTinQuality quality : kQualities) {
          SCOPED_TRACE(name(kind) + ", seed " + std::to_string(seed) + ", error " +
                       std::to_string(error) + ", quality " +
                       std::to_string(static_cast<int>(quality)));
          PointTinOptions options;
          options.max_error = error;
          options.quality = quality;
          const PointTin tin = make(cloud, {}, options);
          EXPECT_EQ(tin.duplicates, cloud.size() - cloud.places());
          check_mesh(tin);
          if (tin.triangles.empty()) {
            EXPECT_TRUE(kind == PointSet::kHorizontal || kind == PointSet::kSlanted);
            EXPECT_EQ(tin.errors.uncovered, cloud.places());
            continue;
          }
          EXPECT_EQ(tin.errors.uncovered, 0u);
          EXPECT_EQ(tin.errors.covered, cloud.places());
          EXPECT_EQ(tin.stuck, 0u);
          EXPECT_LE(tin.errors.largest, error);
          const TinErrors measured = measure(cloud, tin);
          EXPECT_EQ(measured.covered, cloud.size());
          EXPECT_LE(measured.largest, error + 1e-9);
          EXPECT_NEAR(measured.largest, tin.errors.largest, 1e-9);
          if (quality == PointTinQuality::kGreedy) {
            check_delaunay(tin);
            EXPECT_EQ(tin.removed, 0u);
          }
          if (quality != PointTinQuality::kFitted) {
            for (std::size_t v = 0; v < tin.vertices.size(); ++v) {
              const std::uint32_t s = tin.sample[v];
              ASSERT_LT(s, cloud.size());
              EXPECT_EQ(tin.vertices[v], (Point3{cloud.x[s], cloud.y[s], cloud.z[s]}));
            }
          }
        }
      }
    }
  }
}

// So many samples that the first vertices are chosen by few of them, and the last in parts.
TEST(PointTin, KeepsTheErrorOfManySamples) {
  for (const PointSet kind : {PointSet::kUniform, PointSet::kGrid, PointSet::kClusters}) {
    const Cloud cloud = make_cloud(kind, 70000, 17);
    for (const double error : {0.6, 10.0}) {
      for (const PointTinQuality quality : kQualities) {
        SCOPED_TRACE(name(kind) + ", error " + std::to_string(error) + ", quality " +
                     std::to_string(static_cast<int>(quality)));
        PointTinOptions options;
        options.max_error = error;
        options.quality = quality;
        const PointTin tin = make(cloud, {}, options);
        check_mesh(tin);
        EXPECT_LE(tin.errors.largest, error);
        const TinErrors measured = measure(cloud, tin);
        EXPECT_EQ(measured.uncovered, 0u);
        EXPECT_LE(measured.largest, error + 1e-9);
        EXPECT_GE(tin.vertices.size(), 3 + tin.inserted - tin.removed);
      }
    }
  }
}

TEST(PointTin, MeasureSurfaceIsRight) {
  for (const PointSet kind : {PointSet::kUniform, PointSet::kSevenBits, PointSet::kClusters}) {
    for (const std::uint64_t seed : {3u, 4u}) {
      SCOPED_TRACE(name(kind) + ", seed " + std::to_string(seed));
      PointTinOptions options;
      options.max_error = 8;
      const PointTin tin = make(make_cloud(kind, 600, seed), {}, options);
      // Other samples, many of them outside.
      const Cloud other = make_cloud(kind, 900, seed + 10);
      const TinErrors fast = measure(other, tin);
      const TinErrors slow = brute_force(other, tin);
      EXPECT_EQ(fast.covered, slow.covered);
      EXPECT_EQ(fast.uncovered, slow.uncovered);
      EXPECT_NEAR(fast.largest, slow.largest, 1e-8 * (1 + slow.largest));
      EXPECT_NEAR(fast.rms, slow.rms, 1e-8 * (1 + slow.rms));
    }
  }
}

std::vector<Point3> square_frame(double size, std::size_t per_side, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Point3> frame;
  const auto steps = static_cast<double>(per_side);
  for (std::size_t side = 0; side < 4; ++side) {
    for (std::size_t k = 0; k < per_side; ++k) {
      const double t = std::floor(static_cast<double>(k) / steps * size);
      const double height = 20 * to_unit(random());
      if (side == 0) frame.push_back({t, 0, height});
      if (side == 1) frame.push_back({size, t, height});
      if (side == 2) frame.push_back({size - t, size, height});
      if (side == 3) frame.push_back({0, size - t, height});
    }
  }
  return frame;
}

void check_frame(const PointTin& tin, const std::vector<Point3>& frame) {
  const auto border = check_mesh(tin);
  ASSERT_EQ(border.size(), frame.size());
  for (std::uint32_t i = 0; i < frame.size(); ++i) {
    EXPECT_EQ(tin.vertices[i], frame[i]);
    EXPECT_EQ(tin.sample[i], kNoSample);
    const auto next = static_cast<std::uint32_t>((i + 1) % frame.size());
    EXPECT_TRUE(border.contains({i, next})) << "side " << i;
  }
}

TEST(PointTin, KeepsTheFrame) {
  for (const std::uint64_t seed : {5u, 6u, 7u}) {
    for (const PointTinQuality quality : kQualities) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", quality " +
                   std::to_string(static_cast<int>(quality)));
      const std::vector<Point3> frame = square_frame(1000, 1 + 6 * (seed - 5), seed);
      Cloud cloud;
      std::mt19937_64 random(seed);
      std::size_t inside = 0;
      for (std::size_t i = 0; i < 3000; ++i) {
        const double x = 1200 * to_unit(random()) - 100;
        const double y = 1200 * to_unit(random()) - 100;
        inside += x >= 0 && x <= 1000 && y >= 0 && y <= 1000 ? 1 : 0;
        cloud.add(x, y, rough(x / 1000, y / 1000));
      }
      // A hair outside and on the sides, where the frame's heights stand.
      cloud.add(500, std::nextafter(1000.0, 2000.0), 0);
      cloud.add(std::nextafter(0.0, -1.0), 20, 0);
      cloud.add(500, 1000, 500);
      cloud.add(0, 0, -300);
      inside += 2;
      PointTinOptions options;
      options.max_error = 2;
      options.quality = quality;
      const PointTin tin = make(cloud, frame, options);
      check_frame(tin, frame);
      EXPECT_EQ(tin.errors.covered, inside);
      EXPECT_EQ(tin.errors.uncovered, cloud.size() - inside);
      EXPECT_EQ(tin.stuck, 2u);
      EXPECT_GT(tin.errors.largest, 300);
      const TinErrors measured = measure(cloud, tin);
      EXPECT_EQ(measured.covered, inside);
      EXPECT_NEAR(measured.largest, tin.errors.largest, 1e-9);
      // All but these two keep the error.
      cloud.z[cloud.size() - 1] = frame[0][2];
      cloud.x[cloud.size() - 2] = 2000;
      EXPECT_LE(measure(cloud, tin).largest, 2 + 1e-9);
      if (quality == PointTinQuality::kGreedy) check_delaunay(tin);
    }
  }
}

TEST(PointTin, KeepsTheErrorOnALattice) {
  for (const double size : {40.0, 300.0, 32767.0}) {
    for (const PointTinQuality quality : kQualities) {
      SCOPED_TRACE("size " + std::to_string(size) + ", quality " +
                   std::to_string(static_cast<int>(quality)));
      const std::vector<Point3> frame = square_frame(size, 5, 8);
      Cloud cloud;
      std::mt19937_64 random(8);
      for (std::size_t i = 0; i < 4000; ++i) {
        const double x = (1.02 * to_unit(random()) - 0.01) * size;
        const double y = (1.02 * to_unit(random()) - 0.01) * size;
        cloud.add(x, y, rough(x / size, y / size));
      }
      PointTinOptions options;
      options.max_error = 1.5;
      options.quality = quality;
      options.lattice = TinLattice{-100, 0.01};
      const PointTin tin = make(cloud, frame, options);
      check_frame(tin, frame);
      for (std::size_t v = frame.size(); v < tin.vertices.size(); ++v) {
        const Point3& p = tin.vertices[v];
        EXPECT_EQ(p[0], std::floor(p[0]));
        EXPECT_EQ(p[1], std::floor(p[1]));
        const double steps = (p[2] + 100) / 0.01;
        EXPECT_NEAR(steps, std::round(steps), 1e-6);
        EXPECT_EQ(p[0], std::floor(cloud.x[tin.sample[v]] + 0.5));
        EXPECT_EQ(p[1], std::floor(cloud.y[tin.sample[v]] + 0.5));
      }
      const TinErrors measured = measure(cloud, tin);
      EXPECT_EQ(measured.covered, tin.errors.covered);
      EXPECT_NEAR(measured.largest, tin.errors.largest, 1e-9);
      // A coarse lattice cannot show the terrain, and says so.
      if (tin.stuck == 0) {
        EXPECT_LE(tin.errors.largest, 1.5);
      } else {
        EXPECT_GT(tin.errors.largest, 1.5);
      }
      std::size_t above = 0;
      for (std::size_t i = 0; i < cloud.size(); ++i) {
        const Cloud one{{cloud.x[i]}, {cloud.y[i]}, {cloud.z[i]}};
        above += i < 400 && measure(one, tin).largest > 1.5 ? 1 : 0;
      }
      EXPECT_LE(above, tin.stuck);
    }
  }
}

TEST(PointTin, LatticeTooCoarseForTheError) {
  Cloud cloud;
  std::mt19937_64 random(9);
  for (std::size_t i = 0; i < 2000; ++i)
    cloud.add(20 * to_unit(random()), 20 * to_unit(random()), 100 * to_unit(random()));
  PointTinOptions options;
  options.lattice = TinLattice{0, 5};
  const std::vector<Point3> frame{{0, 0, 0}, {20, 0, 0}, {20, 20, 0}, {0, 20, 0}};
  for (const PointTinQuality quality : kQualities) {
    options.quality = quality;
    const PointTin tin = make(cloud, frame, options);
    check_frame(tin, frame);
    EXPECT_GT(tin.stuck, 0u);
    EXPECT_GT(tin.errors.largest, 0);
    EXPECT_NEAR(measure(cloud, tin).largest, tin.errors.largest, 1e-9);
  }
}

TEST(PointTin, Duplicates) {
  const Cloud cloud{{0, 10, 10, 0, 5, 5, 5}, {0, 0, 10, 10, 5, 5, 5}, {0, 0, 0, 0, 7, 2, 6}};
  const std::pair<PointDuplicates, double> cases[] = {{PointDuplicates::kFirst, 7},
                                                      {PointDuplicates::kMin, 2},
                                                      {PointDuplicates::kMax, 7},
                                                      {PointDuplicates::kMean, 5}};
  PointTinOptions options;
  for (const auto& [duplicates, height] : cases) {
    options.duplicates = duplicates;
    const PointTin tin = make(cloud, {}, options);
    EXPECT_EQ(tin.duplicates, 2u);
    ASSERT_EQ(tin.vertices.size(), 5u);
    EXPECT_EQ(tin.vertices[4], (Point3{5, 5, height}));
    EXPECT_EQ(tin.sample[4], 4u);
    EXPECT_EQ(tin.errors.largest, 0);
  }
  options.duplicates = PointDuplicates::kError;
  try {
    make(cloud, {}, options);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("sample 5"), std::string::npos) << error.what();
  }
}

TEST(PointTin, NothingToTriangulate) {
  const PointTinOptions options;
  for (const std::size_t count : {0u, 1u, 2u, 3u, 50u}) {
    Cloud equal;
    Cloud line;
    for (std::size_t i = 0; i < count; ++i) {
      equal.add(3, 4, static_cast<double>(i));
      line.add(0.1 * static_cast<double>(i), 0, 1);
    }
    const PointTin none = make(equal, {}, options);
    EXPECT_TRUE(none.vertices.empty());
    EXPECT_EQ(none.errors.uncovered, count == 0 ? 0u : 1u);
    const PointTin flat = make(line, {}, options);
    EXPECT_TRUE(flat.vertices.empty());
    EXPECT_EQ(flat.errors.uncovered, count);
  }
  // A frame alone is a surface.
  const std::vector<Point3> frame{{0, 0, 1}, {2, 0, 2}, {1, 3, 3}};
  const PointTin tin = make({}, frame, options);
  check_frame(tin, frame);
  EXPECT_EQ(tin.errors.covered, 0u);
}

TEST(PointTin, HugeAndTinyPlaces) {
  for (const double scale : {1e90, 1e-90, 1e-160}) {
    Cloud cloud = make_cloud(PointSet::kUniform, 300, 11);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      cloud.x[i] = cloud.x[i] * scale - scale / 2;
      cloud.y[i] *= scale;
    }
    for (const PointTinQuality quality : kQualities) {
      SCOPED_TRACE(scale);
      PointTinOptions options;
      options.max_error = 3;
      options.quality = quality;
      const PointTin tin = make(cloud, {}, options);
      check_mesh(tin);
      EXPECT_EQ(tin.errors.covered, cloud.size());
      EXPECT_LE(tin.errors.largest, 3);
    }
  }
}

TEST(PointTin, MaxPoints) {
  const Cloud cloud = make_cloud(PointSet::kUniform, 3000, 12);
  double before = std::numeric_limits<double>::infinity();
  for (const std::size_t points : {50u, 200u, 800u}) {
    double greedy = 0;
    for (const PointTinQuality quality : kQualities) {
      SCOPED_TRACE(std::to_string(points) + " points, quality " +
                   std::to_string(static_cast<int>(quality)));
      PointTinOptions options;
      options.max_points = points;
      options.quality = quality;
      const PointTin tin = make(cloud, {}, options);
      check_mesh(tin);
      EXPECT_LE(tin.vertices.size(), points);
      EXPECT_GE(tin.vertices.size(), points * 8 / 10);
      EXPECT_NEAR(tin.errors.largest, measure(cloud, tin).largest, 1e-9);
      if (quality == PointTinQuality::kGreedy) greedy = tin.errors.largest;
      EXPECT_LE(tin.errors.largest, greedy);
    }
    EXPECT_LT(greedy, before);
    before = greedy;
  }
  // The error comes first where it is the weaker wish.
  PointTinOptions options;
  options.max_error = 30;
  const PointTin free = make(cloud, {}, options);
  options.max_points = 2000;
  EXPECT_EQ(make(cloud, {}, options).vertices, free.vertices);
  // The hull's corners stay.
  options.max_points = 1;
  EXPECT_GE(make(cloud, {}, options).vertices.size(), 3u);
}

TEST(PointTin, OrderOfSamplesDoesNotMatterForTheResult) {
  // All places differ, so the order along the curve and with it all else is the same.
  const Cloud cloud = make_cloud(PointSet::kUniform, 4000, 13);
  Cloud shuffled = cloud;
  std::mt19937_64 random(13);
  for (std::size_t i = cloud.size(); i-- > 1;) {
    const std::size_t k = random() % (i + 1);
    std::swap(shuffled.x[i], shuffled.x[k]);
    std::swap(shuffled.y[i], shuffled.y[k]);
    std::swap(shuffled.z[i], shuffled.z[k]);
  }
  for (const PointTinQuality quality : kQualities) {
    PointTinOptions options;
    options.max_error = 1;
    options.quality = quality;
    const PointTin a = make(cloud, {}, options);
    const PointTin b = make(cloud, {}, options);
    EXPECT_EQ(a.vertices, b.vertices);
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_EQ(a.sample, b.sample);
    const PointTin c = make(shuffled, {}, options);
    EXPECT_LE(c.errors.largest, 1);
    const auto count = static_cast<double>(a.triangles.size());
    EXPECT_NEAR(static_cast<double>(c.triangles.size()), count, 0.1 * count);
  }
}

TEST(PointTin, PlanesNeedNoVertices) {
  Cloud cloud;
  std::mt19937_64 random(14);
  for (std::size_t i = 0; i < 2000; ++i) {
    const double x = static_cast<double>(random() % 1024);
    const double y = static_cast<double>(random() % 1024);
    cloud.add(x, y, 3 * x - 2 * y + 7);
  }
  for (const double x : {-1.0, 1024.0})
    for (const double y : {-1.0, 1024.0}) cloud.add(x, y, 3 * x - 2 * y + 7);
  PointTinOptions options;
  options.max_error = 1e-9;
  const PointTin tin = make(cloud, {}, options);
  EXPECT_EQ(tin.triangles.size(), 2u);
}

TEST(PointTin, BetterQualityMeansFewerTriangles) {
  const Cloud cloud = make_cloud(PointSet::kUniform, 20000, 15);
  std::size_t triangles[3];
  for (std::size_t q = 0; q < 3; ++q) {
    PointTinOptions options;
    options.max_error = 2;
    options.quality = kQualities[q];
    triangles[q] = make(cloud, {}, options).triangles.size();
  }
  EXPECT_LT(static_cast<double>(triangles[1]), 0.8 * static_cast<double>(triangles[0]));
  EXPECT_LT(static_cast<double>(triangles[2]), 0.97 * static_cast<double>(triangles[1]));
}

template <class Call>
std::string refused(Call call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(PointTin, RefusesBadInput) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Cloud cloud{{0, 10, 10, 0}, {0, 0, 10, 10}, {0, 0, 0, 0}};
  const auto with = [&](std::vector<double> Cloud::*axis, double value) {
    Cloud bad = cloud;
    (bad.*axis)[2] = value;
    return refused([&] { make(bad, {}, {}); });
  };
  EXPECT_NE(with(&Cloud::x, nan).find("x of sample 2"), std::string::npos);
  EXPECT_NE(with(&Cloud::y, HUGE_VAL).find("y of sample 2"), std::string::npos);
  EXPECT_NE(with(&Cloud::z, 1e200).find("z of sample 2"), std::string::npos);
  EXPECT_NE(refused([&] { (void)point_tin(cloud.x, cloud.y, {}, {}, {}); }), "accepted");
  const auto options = [&](auto change) {
    PointTinOptions bad;
    change(bad);
    return refused([&] { make(cloud, {}, bad); });
  };
  EXPECT_NE(options([&](auto& o) { o.max_error = -1; }), "accepted");
  EXPECT_NE(options([&](auto& o) { o.max_error = nan; }), "accepted");
  EXPECT_NE(options([&](auto& o) { o.min_angle_degrees = 40; }), "accepted");
  EXPECT_NE(options([&](auto& o) { o.lattice = TinLattice{0, 1}; }), "accepted");
  EXPECT_NE(options([&](auto& o) { o.lattice = TinLattice{0, 0}; }), "accepted");
  const auto frame = [&](std::vector<Point3> bad) {
    return refused([&] { make(cloud, bad, {}); });
  };
  EXPECT_NE(frame({{0, 0, 0}, {1, 0, 0}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {0, 1, 0}, {1, 0, 0}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {3, 1, 0}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {4, 0, 0}, {4, 0, 0}, {4, 4, 0}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {4, 0, 0}, {2, 0, 0}, {4, 4, 0}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {4, 0, 0}, {4, 4, nan}}), "accepted");
  EXPECT_NE(frame({{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 0, 0}, {4, 0, 0}, {4, 4, 0}}), "accepted");
  // A pentagram turns left everywhere, but goes around twice.
  EXPECT_NE(frame({{0, 3, 0}, {-2, -2, 0}, {3, 1, 0}, {-3, 1, 0}, {2, -2, 0}}), "accepted");
  PointTinOptions lattice;
  lattice.lattice = TinLattice{0, 1};
  EXPECT_NE(refused([&] {
              make(cloud, {{0, 0, 0}, {4.5, 0, 0}, {4, 4, 0}}, lattice);
            }),
            "accepted");
  EXPECT_EQ(refused([&] { make(cloud, {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}}, lattice); }), "accepted");
  EXPECT_NE(refused([&] {
              const std::vector<Point3> v{{0, 0, 0}};
              const std::vector<std::array<std::uint32_t, 3>> t{{0, 0, 1}};
              (void)measure_surface(cloud.x, cloud.y, cloud.z, v, t);
            }),
            "accepted");
}

/// Every sample against the chain, by brute force.
double line_error(const std::vector<double>& t, const std::vector<double>& z,
                  const SimplifiedLine& line) {
  double worst = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (i > 0 && t[i] == t[i - 1]) continue;
    double height = t[i] <= line.vertices.front().t ? line.vertices.front().height
                                                    : line.vertices.back().height;
    for (std::size_t k = 1; k < line.vertices.size(); ++k) {
      const LineVertex& a = line.vertices[k - 1];
      const LineVertex& b = line.vertices[k];
      if (t[i] >= a.t && t[i] <= b.t)
        height = (a.height * (b.t - t[i]) + b.height * (t[i] - a.t)) / (b.t - a.t);
    }
    worst = std::max(worst, std::abs(height - z[i]));
  }
  return worst;
}

TEST(SimplifyLine, KeepsTheError) {
  for (const std::uint64_t seed : {21u, 22u, 23u}) {
    for (const bool on_lattice : {false, true}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + (on_lattice ? ", lattice" : ""));
      std::mt19937_64 random(seed);
      std::vector<double> t;
      std::vector<double> z;
      for (std::size_t i = 0; i < 1500; ++i) t.push_back(2000 * to_unit(random()));
      std::sort(t.begin(), t.end());
      for (std::size_t i = 7; i < t.size(); i += 100) t[i] = t[i - 1];
      for (const double u : t) z.push_back(rough(u / 2000, 0.3));
      std::size_t before = t.size() + 1;
      for (const double error : {0.0, 0.05, 1.0, 10.0, 1000.0}) {
        std::optional<TinLattice> lattice;
        if (on_lattice) lattice = TinLattice{1, 0.25};
        const SimplifiedLine line = simplify_line(t, z, error, lattice);
        EXPECT_NEAR(line_error(t, z, line), line.largest_error, 1e-10);
        if (!on_lattice || error >= 10) {
          EXPECT_LE(line.largest_error, error);
        }
        EXPECT_LE(line.vertices.size(), before);
        before = line.vertices.size();
        EXPECT_EQ(line.vertices.front().sample, 0u);
        for (std::size_t k = 0; k < line.vertices.size(); ++k) {
          const LineVertex& v = line.vertices[k];
          if (k > 0) {
            EXPECT_GT(v.t, line.vertices[k - 1].t);
          }
          if (on_lattice) {
            EXPECT_EQ(v.t, std::floor(t[v.sample] + 0.5));
            EXPECT_EQ(v.height * 4, std::floor(v.height * 4));
          } else {
            EXPECT_EQ(v.t, t[v.sample]);
            EXPECT_EQ(v.height, z[v.sample]);
          }
        }
      }
      EXPECT_EQ(before, 2u);
    }
  }
}

TEST(SimplifyLine, FewAndBadSamples) {
  EXPECT_TRUE(simplify_line({}, {}, 1).vertices.empty());
  const std::vector<double> t{1, 1, 1};
  const std::vector<double> z{5, 6, 7};
  const SimplifiedLine one = simplify_line(t, z, 0);
  ASSERT_EQ(one.vertices.size(), 1u);
  EXPECT_EQ(one.vertices[0].height, 5);
  EXPECT_EQ(one.largest_error, 0);
  const std::vector<double> close{0.1, 0.2, 0.3};
  const SimplifiedLine rounded = simplify_line(close, z, 0, TinLattice{0, 1});
  ASSERT_EQ(rounded.vertices.size(), 1u);
  EXPECT_EQ(rounded.largest_error, 2);
  const std::vector<double> down{1, 3, 2};
  EXPECT_NE(refused([&] { (void)simplify_line(down, z, 1); }).find("sample 2"), std::string::npos);
  const std::vector<double> nan{1, 2, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_NE(refused([&] { (void)simplify_line(t, nan, 1); }).find("sample 2"), std::string::npos);
  EXPECT_NE(refused([&] { (void)simplify_line(t, z, -1); }), "accepted");
  EXPECT_NE(refused([&] { (void)simplify_line(t, {}, 1); }), "accepted");
  EXPECT_NE(refused([&] { (void)simplify_line(t, z, 1, TinLattice{0, -1}); }), "accepted");
}

}  // namespace
}  // namespace terrace::tri
