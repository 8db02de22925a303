// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "delaunay2/double_kernel.hpp"
#include "points.hpp"
#include "terrace/tri/point_tin.hpp"

/// Shared by tests of meshes of points: clouds with heights, and brute-force checks of a mesh.

namespace terrace::tri::point_tin_oracle {

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

inline PointTin make(const Cloud& cloud, const std::vector<Point3>& frame,
                     const PointTinOptions& options) {
  return point_tin(cloud.x, cloud.y, cloud.z, frame, options);
}
inline TinErrors measure(const Cloud& cloud, const PointTin& tin) {
  return measure_surface(cloud.x, cloud.y, cloud.z, tin.vertices, tin.triangles);
}

inline double rough(double u, double v) {
  return 40 * std::sin(5 * u + 2 * v) + 25 * std::sin(11 * v - 3 * u) + 6 * std::sin(31 * u * v) +
         2 * std::sin(97 * u + 41 * v);
}

/// Heights by the position within the unit square of the cloud's bounding box, with steps and
/// noise.
inline Cloud make_cloud(PointSet kind, std::size_t count, std::uint64_t seed) {
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

inline Place place_of(const PointTin& tin, std::uint32_t v) {
  return {tin.vertices[v][0], tin.vertices[v][1]};
}

/// Triangles must be counter-clockwise, every edge must occur once in each direction except for a
/// simple border, and no vertex may be duplicated or unused. Returns the border's edges.
inline std::set<std::array<std::uint32_t, 2>> check_mesh(const PointTin& tin) {
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
  // By Euler's formula, the mesh is a disc.
  if (!tin.triangles.empty()) {
    EXPECT_EQ(tin.triangles.size(), 2 * tin.vertices.size() - 2 - border.size());
  }
  return border;
}

inline void check_delaunay(const PointTin& tin) {
  for (const auto& t : tin.triangles) {
    for (std::uint32_t v = 0; v < tin.vertices.size(); ++v) {
      if (v == t[0] || v == t[1] || v == t[2]) continue;
      ASSERT_LE(DoubleKernel::in_circle(place_of(tin, t[0]), place_of(tin, t[1]),
                                        place_of(tin, t[2]), place_of(tin, v)),
                0);
    }
  }
}

/// Tests every sample in every triangle, with a different formula from the library's.
inline TinErrors brute_force(const Cloud& cloud, const PointTin& tin) {
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

inline constexpr TinQuality kQualities[] = {TinQuality::greedy, TinQuality::removal,
                                            TinQuality::fitted};

inline void check_frame(const PointTin& tin, const std::vector<Point3>& frame) {
  const auto border = check_mesh(tin);
  ASSERT_EQ(border.size(), frame.size());
  for (std::uint32_t i = 0; i < frame.size(); ++i) {
    EXPECT_EQ(tin.vertices[i], frame[i]);
    EXPECT_EQ(tin.sample[i], kNoSample);
    const auto next = static_cast<std::uint32_t>((i + 1) % frame.size());
    EXPECT_TRUE(border.contains({i, next})) << "side " << i;
  }
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

}  // namespace terrace::tri::point_tin_oracle
