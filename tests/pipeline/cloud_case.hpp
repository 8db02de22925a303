// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/geotiff_writer.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>
#include <terrace/tri/interpolation.hpp>

#include "random.hpp"
#include "surface/corner.hpp"
#include "surface/point_window.hpp"
#include "surface/store_window.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/region.hpp"

/// Clouds of many kinds in small stores with many clusters, and the triangulation of all their
/// points.

namespace terrace::tests {

using Points = std::vector<stream::Point3>;
using Triangle = std::array<terrain::Point2, 3>;
using terrain::Point2;

inline bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

inline Points points_of(const std::string& kind) {
  Random random(7);
  Points points;
  const auto add = [&](double x, double y) { points.push_back({x, y, 10 * random.unit()}); };
  if (kind == "random") {
    for (int i = 0; i < 4000; ++i) add(random.unit() * 1000, random.unit() * 700);
  } else if (kind == "lattice") {
    for (int i = 0; i < 3600; ++i) add(i % 60, i / 60);
  } else if (kind == "duplicates") {
    for (int i = 0; i < 3000; ++i) {
      add(random.unit() * 30, random.unit() * 30);
      for (std::uint64_t k = random.below(4); k > 0; --k) add(points.back()[0], points.back()[1]);
    }
    for (int i = 0; i < 1500; ++i) {
      add(static_cast<double>(random.below(30)), static_cast<double>(random.below(30)));
    }
  } else if (kind == "voids") {
    for (int i = 0; i < 6000; ++i) {
      const double x = random.unit() * 1000, y = random.unit() * 1000;
      const bool lake = std::hypot(x - 400, y - 600) < 250 || std::abs(y - x + 500) < 60;
      if (!lake) add(x, y);
    }
  } else if (kind == "clusters") {
    for (int k = 0; k < 12; ++k) {
      const double x = random.unit() * 1e5, y = random.unit() * 1e5, r = random.unit() * 500;
      for (int i = 0; i < 250; ++i) add(x + random.unit() * r, y + random.unit() * r);
    }
  } else if (kind == "turned") {  // a narrow strip: most of its box is outside the hull
    for (int i = 0; i < 3000; ++i) {
      const double t = random.unit() * 1000, s = random.unit() * 60;
      add(0.8 * t - 0.6 * s, 0.6 * t + 0.8 * s);
    }
  } else if (kind == "winding") {  // a swath whose bends leave voids within the hull
    for (int i = 0; i < 12000; ++i) {
      const double t = i * 0.5 + random.unit() * 2;
      const double s = random.unit() * 30 + 250 * std::sin(t / 400);
      add(0.8 * t - 0.6 * s, 0.6 * t + 0.8 * s);
    }
  } else if (kind == "straight borders") {  // a tile that was cut out of a scan
    for (int i = 0; i < 3000; ++i) add(std::round(random.unit() * 1e3), random.unit() * 1000);
    for (int i = 0; i < 600; ++i) add(i % 2 * 1000, random.unit() * 1000);
    for (int i = 0; i < 600; ++i) add(random.unit() * 1000, i % 2 * 1000);
  } else if (kind == "circle") {  // slivers along the hull, one common circle inside
    for (int i = 0; i < 700; ++i) add(std::cos(i * 0.1) * 1000, std::sin(i * 0.1) * 1000);
  } else if (kind == "parabola") {
    for (int i = 0; i < 800; ++i) add(i, 1e-5 * i * i);
  } else if (kind == "far") {
    for (int i = 0; i < 2500; ++i) add(4e15 + 2 * i % 77, -8e15 + random.unit() * 2e3);
  } else if (kind == "huge") {
    for (int i = 0; i < 600; ++i) add(random.unit() * 1e148, random.unit() * 1e148);
  } else if (kind == "tiny") {
    for (int i = 0; i < 300; ++i) add(random.unit() * 1e-170, random.unit() * 1e-170);
  } else if (kind == "line") {
    for (int i = 0; i < 700; ++i) add(3 * i, 5 - 2 * i);
  } else if (kind == "nearly a line") {
    for (int i = 0; i < 900; ++i) add(i % 450, 0);
    add(225, 1);
  } else if (kind == "one") {
    add(4, 5);
  } else if (kind == "two") {
    add(4, 5);
    add(6, 5);
  } else if (kind == "one place") {
    for (int i = 0; i < 400; ++i) add(2.5, 7.5);
  }
  return points;
}

inline std::filesystem::path cloud_store(const std::filesystem::path& folder, const Points& points,
                                         std::uint64_t block_points = 100) {
  std::filesystem::create_directories(folder);
  std::ofstream out(folder / "cloud.xyz");
  out.precision(17);
  for (const stream::Point3& p : points) out << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
  out.close();
  terrain::BuildRequest request;
  request.inputs = {(folder / "cloud.xyz").string()};
  request.store = folder / "cloud.store";
  request.block_points = block_points;
  request.facility_cost = 1.0;
  terrain::build_store(request);
  return request.store;
}

inline Triangle turned(Triangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

inline std::filesystem::path raster_store(const std::filesystem::path& folder) {
  stream::GeoTiffOptions options;
  options.columns = 150;
  options.rows = 120;
  options.sample.type = stream::ScalarType::i16;
  options.sample.scale = 0.25;
  options.sample.offset = 100;
  options.world.xy = {30, 0, 500000, 0, -30, 5200000};
  options.nodata = -1;
  std::vector<std::int16_t> samples;
  for (int i = 0; i < 150 * 120; ++i) {
    const double x = i % 150, y = i / 150;
    samples.push_back(std::hypot(x - 60, y - 50) < 30 ? std::int16_t{-1}
                                                      : static_cast<std::int16_t>(i * 7 % 1009));
  }
  stream::GeoTiffWriter writer(folder / "dem.tif", options);
  writer.write_rows(std::as_bytes(std::span(samples)));
  writer.commit();
  terrain::BuildRequest request;
  request.inputs = {(folder / "dem.tif").string()};
  request.store = folder / "dem.store";
  request.block_points = 300;
  request.facility_cost = 1.0;
  terrain::build_store(request);
  return request.store;
}

/// True if no line separates them; computed in long double.
inline bool meets(const Triangle& t, const terrain::StoredBox& box) {
  using Number = long double;
  const std::array<Point2, 4> corner{Point2{box.min[0], box.min[1]}, Point2{box.max[0], box.min[1]},
                                     Point2{box.max[0], box.max[1]},
                                     Point2{box.min[0], box.max[1]}};
  for (std::size_t k = 0; k < 2; ++k) {
    if (std::max({t[0][k], t[1][k], t[2][k]}) < box.min[k]) return false;
    if (std::min({t[0][k], t[1][k], t[2][k]}) > box.max[k]) return false;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const Point2 &a = t[i], &b = t[(i + 1) % 3];
    if (std::all_of(corner.begin(), corner.end(), [&](const Point2& p) {
          return (Number{b[0]} - a[0]) * (Number{p[1]} - a[1]) <
                 (Number{b[1]} - a[1]) * (Number{p[0]} - a[0]);
        })) {
      return false;
    }
  }
  return true;
}

/// All points of a level and above in one triangulation.
struct Whole {
  tri::Delaunay2<double> triangulation;
  std::vector<double> heights;
  std::map<Triangle, std::array<double, 3>> triangles;

  Whole(const stream::Store& store, unsigned level) : Whole(points_in(store, level)) {}
  /// points: x and y as stored, heights in the vertical unit.
  explicit Whole(std::span<const stream::Point3> points) {
    for (const stream::Point3& p : points) {
      const auto inserted = triangulation.insert({p[0], p[1]});
      if (!inserted.created) continue;  // keep the first of several
      heights.resize(triangulation.vertex_slots());
      heights[tri::slot(inserted.vertex)] = p[2];
    }
    for (const tri::TriangleId t : triangulation.all_triangles()) {
      add_triangle(triangulation, heights, t, triangles);
    }
  }

  static Points points_in(const stream::Store& store, unsigned level) {
    constexpr double kAll = std::numeric_limits<double>::infinity();
    terrain::StoreWindow reader(store);
    terrain::WindowPoints points;
    reader.points({{-kAll, -kAll}, {kAll, kAll}}, points, level);
    const stream::Channel& z = store.schema().coordinates[2];
    for (stream::Point3& p : points.positions) p[2] = p[2] * z.scale + z.offset;
    return points.positions;
  }
  [[nodiscard]] terrain::SurfaceCorner corner(tri::VertexId v) const {
    return {triangulation.point(v), heights[tri::slot(v)]};
  }
  [[nodiscard]] terrain::SurfaceTriangle corners(tri::TriangleId t) const {
    const auto v = triangulation.vertices(t);
    return {corner(v[0]), corner(v[1]), corner(v[2])};
  }
  /// The linear surface, see terrain::PointSurface::linear().
  [[nodiscard]] terrain::SurfacePoint at(const Point2& place,
                                         const terrain::TooLong& too_long = {}) const {
    const auto on_segment = [&](tri::VertexId v, tri::VertexId w,
                                std::vector<terrain::SurfaceTriangle> sides) {
      const terrain::SurfaceCorner a = corner(v), b = corner(w);
      if (too_long && too_long(a.place, b.place)) return terrain::SurfacePoint{};
      return terrain::where_triangles_meet(place, terrain::on_edge(a, b, place), sides, too_long);
    };
    const tri::Location found = triangulation.locate(place);
    if (found.place == tri::Place::vertex) {
      std::vector<terrain::SurfaceTriangle> round;
      for (const tri::TriangleId t : triangulation.all_triangles()) {
        const auto v = triangulation.vertices(t);
        if (std::find(v.begin(), v.end(), found.vertex) != v.end()) round.push_back(corners(t));
      }
      return terrain::where_triangles_meet(place, corner(found.vertex).height, round, too_long);
    }
    if (found.place == tri::Place::edge) {
      const auto v = triangulation.vertices(found.triangle);
      std::vector<terrain::SurfaceTriangle> sides{corners(found.triangle)};
      const tri::TriangleId other = triangulation.neighbours(found.triangle)[found.edge];
      if (other != tri::kNoTriangle) sides.push_back(corners(other));
      return on_segment(v[(found.edge + 1) % 3], v[(found.edge + 2) % 3], sides);
    }
    if (found.place == tri::Place::inside) {
      const terrain::SurfaceTriangle t = corners(found.triangle);
      return terrain::is_surface(t, too_long) ? terrain::on_plane(t, place)
                                              : terrain::SurfacePoint{};
    }
    if (triangulation.triangle_count() > 0) return {};
    // All points are collinear.
    std::vector<tri::VertexWeight> weights;
    tri::weights_at(triangulation, place, tri::Interpolation::linear, weights);
    return weights.size() == 2 ? on_segment(weights[0].vertex, weights[1].vertex, {})
                               : terrain::SurfacePoint{};
  }

  static void add_triangle(const tri::Delaunay2<double>& of, const std::vector<double>& heights,
                           tri::TriangleId t, std::map<Triangle, std::array<double, 3>>& to) {
    const auto v = of.vertices(t);
    Triangle corners;
    std::map<Point2, double> height;
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = of.point(v[k]);
      height[corners[k]] = heights[tri::slot(v[k])];
    }
    corners = turned(corners);
    to[corners] = {height[corners[0]], height[corners[1]], height[corners[2]]};
  }
};

/// Checks that the certain triangles of a window are those of the whole, and that all that meet the
/// box are among them.
inline void check_window(const Whole& whole, const terrain::PointWindow& window,
                         const terrain::StoredBox& box) {
  std::map<Triangle, std::array<double, 3>> certain;
  for (const tri::TriangleId t : window.triangulation().all_triangles()) {
    if (!window.is_certain(t)) continue;
    Whole::add_triangle(window.triangulation(), window.heights(), t, certain);
  }
  for (const auto& [corners, heights] : certain) {
    const auto found = whole.triangles.find(corners);
    ASSERT_TRUE(found != whole.triangles.end());
    ASSERT_EQ(heights, found->second);
  }
  for (const auto& [corners, heights] : whole.triangles) {
    if (meets(corners, box)) {
      ASSERT_TRUE(certain.contains(corners));
    }
  }
}

}  // namespace terrace::tests
