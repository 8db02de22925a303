// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>

#include "cloud_case.hpp"
#include "random.hpp"
#include "terrace/terrain/detail_mesh.hpp"

/// Random focuses in stores, and the points of the mesh of mixed levels.

namespace terrace::tests {

/// Returns a box or a polygon around a random point of the store, in its CRS.
inline terrain::Region random_region(const stream::Store& store, Random& random) {
  const Points points = Whole::points_in(store, 0);
  const stream::Box3 world = world_box(store.schema(), store.bounds());
  const stream::Point3& p = points[random.below(points.size())];
  const stream::Point3 centre = world_point(store.schema(), {p[0], p[1], 0});
  Point2 half{};
  for (std::size_t k = 0; k < 2; ++k) {
    half[k] = random(0.05, 0.3) * std::max(world.max[k] - world.min[k], 1e-300);
  }
  constexpr double kAll = std::numeric_limits<double>::infinity();
  if (random.below(2) == 0) {
    return terrain::Region::of_box({{centre[0] - half[0], centre[1] - half[1], -kAll},
                                    {centre[0] + half[0], centre[1] + half[1], kAll}});
  }
  const std::size_t corners = 3 + random.below(5);
  std::vector<Point2> ring;
  for (std::size_t i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * (static_cast<double>(i) + 0.8 * random.unit()) /
                         static_cast<double>(corners);
    const double reach = random(0.4, 1.3);
    ring.push_back({centre[0] + reach * half[0] * std::cos(angle),
                    centre[1] + reach * half[1] * std::sin(angle)});
  }
  return terrain::Region::of_polygons({{ring}}, -kAll, kAll);
}

/// Returns a random level other than 0 and one to three focuses with finer levels, mostly 0.
inline terrain::Detail random_detail(const stream::Store& store, Random& random) {
  terrain::Detail detail{.level = 1 + static_cast<unsigned>(random.below(store.top()))};
  for (std::uint64_t i = 0; i <= random.below(3); ++i) {
    const auto level = random.below(3) > 0 ? 0U : static_cast<unsigned>(random.below(detail.level));
    detail.focuses.push_back({random_region(store, random), level});
  }
  return detail;
}

/// The vertices and triangles of detail_mesh(), with x and y as stored. Columns and rows of a
/// raster are exact.
struct FocusMesh {
  Points points;
  std::vector<std::array<stream::Point3, 3>> triangles;

  FocusMesh(const stream::Store& store, const terrain::Detail& detail) {
    const terrain::TriangleMesh mesh = terrain::detail_mesh(store, detail, {}, {});
    for (const stream::Point3& p : mesh.positions) {
      Point2 place = stored_place(store.schema(), {p[0], p[1]});
      if (store.schema().grid) place = {std::round(place[0]), std::round(place[1])};
      points.push_back({place[0], place[1], p[2]});
    }
    for (const auto& corners : mesh.triangles) {
      triangles.push_back({points[corners[0]], points[corners[1]], points[corners[2]]});
    }
  }
};

inline bool covers(const terrain::FinerRegion& focus, const stream::Store& store,
                   const Point2& stored) {
  const stream::Point3 p = world_point(store.schema(), {stored[0], stored[1], 0});
  return focus.region.covers({p[0], p[1]});
}

/// Whether the line from a to b meets the box.
inline bool meets_box(const Point2& a, const Point2& b, const stream::Box3& box) {
  double begin = 0, end = 1;
  for (std::size_t k = 0; k < 2; ++k) {
    const double way = b[k] - a[k];
    if (way == 0 && (a[k] < box.min[k] || a[k] > box.max[k])) return false;
    if (way == 0) continue;
    const double s = (box.min[k] - a[k]) / way, t = (box.max[k] - a[k]) / way;
    begin = std::max(begin, std::min(s, t));
    end = std::min(end, std::max(s, t));
  }
  return begin <= end;
}

/// Whether the part of a raster within `cells` columns and rows of a place is inside a focus of
/// level 0.
inline bool is_in_full_detail(const stream::Store& store, const terrain::Detail& detail,
                              const Point2& place, double cells) {
  stream::Box3 around{{0, 0, 0}, {0, 0, 0}};
  const Point2 last{static_cast<double>(store.schema().columns - 1),
                    static_cast<double>(store.schema().rows - 1)};
  for (std::size_t k = 0; k < 2; ++k) {
    around.min[k] = std::clamp(place[k] - cells, 0.0, last[k]);
    around.max[k] = std::clamp(place[k] + cells, 0.0, last[k]);
  }
  return std::any_of(detail.focuses.begin(), detail.focuses.end(),
                     [&](const terrain::FinerRegion& focus) {
                       if (focus.level > 0) return false;
                       for (unsigned corner = 0; corner < 4; ++corner) {
                         const Point2 p{(corner & 1 ? around.max : around.min)[0],
                                        (corner & 2 ? around.max : around.min)[1]};
                         if (!covers(focus, store, p)) return false;
                       }
                       const stream::Box3 box = world_box(store.schema(), around);
                       for (const auto& polygon : focus.region.polygons()) {
                         const auto& ring = polygon.front();
                         for (std::size_t i = 0; i < ring.size(); ++i) {
                           if (meets_box(ring[i], ring[(i + 1) % ring.size()], box)) return false;
                         }
                       }
                       return true;
                     });
}

}  // namespace terrace::tests
