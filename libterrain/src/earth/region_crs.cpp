// SPDX-License-Identifier: Apache-2.0
#include "earth/region_crs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <terrace/base/portable_math.hpp>

#include "base/region_shape.hpp"
#include "earth/crs/definition.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::terrain {
namespace {

stream::Error fault(const CoordinateSystem& to, const std::string& cause) {
  return stream::Error("", cause + " " + to.title())
      .at("region")
      .remedy("pass a smaller region, or one in the CRS of the data");
}

class Outline {
 public:
  explicit Outline(const Transformation& change)
      : change_(change), to_(change.from()), turn_(to_.turn()) {}

  std::vector<Point2> ring(const std::vector<Point2>& corners) const {
    std::vector<Point2> result;
    const Point2 first = moved(corners[0]);
    Point2 start = first;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Point2 &a = corners[i], &b = corners[(i + 1) % corners.size()];
      result.push_back(start);
      // Always split an edge a few times: one with a straight middle may still bend.
      start = add_from(a, b, start, 0, result);
    }
    // Around a pole, the outline ends a full turn away from its start.
    if (turn_ != 0 && std::abs(start[0] - first[0]) > 0.5 * turn_) {
      throw fault(to_, "the region contains a pole, so its outline is not a polygon in");
    }
    return result;
  }

 private:
  [[nodiscard]] Point2 moved(Point2 place) const {
    change_.reverse({&place, 1});
    if (!std::isfinite(place[0]) || !std::isfinite(place[1])) {
      throw fault(to_, "the region's outline leaves the area of");
    }
    return place;
  }
  /// Longitudes continue beyond the antimeridian instead of jumping back.
  [[nodiscard]] Point2 moved(const Point2& corner, const Point2& near) const {
    Point2 place = moved(corner);
    if (turn_ != 0) place[0] += turn_ * std::round((near[0] - place[0]) / turn_);
    return place;
  }

  /// Appends the curve from a, with its image `start`, to b, without its ends. Returns the image of
  /// b.
  Point2 add_from(const Point2& a, const Point2& b, const Point2& start, int depth,
                  std::vector<Point2>& result) const {
    constexpr int kMin = 4, kMost = 14;
    const Point2 middle{0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])};
    if (depth < kMin) {
      const Point2 place = add_from(a, middle, start, depth + 1, result);
      result.push_back(place);
      return add_from(middle, b, place, depth + 1, result);
    }
    const Point2 place = moved(middle, start), end = moved(b, place);
    const double length = base::hypot(end[0] - start[0], end[1] - start[1]);
    const double off =
        base::hypot(place[0] - 0.5 * (start[0] + end[0]), place[1] - 0.5 * (start[1] + end[1]));
    if (off <= 1e-6 * length) return end;
    if (depth == kMost) {
      // By now the pieces of a smooth curve are straight. Only a jump is not.
      if (off > 0.1 * length) throw fault(to_, "the region's outline is discontinuous in");
      return end;
    }
    const Point2 half = add_from(a, middle, start, depth + 1, result);
    result.push_back(half);
    return add_from(middle, b, half, depth + 1, result);
  }

  const Transformation& change_;
  const CoordinateSystem& to_;
  double turn_;  ///< from CoordinateSystem::turn()
};

std::vector<Polygon> outlines(const Region& region) {
  if (!region.polygons().empty()) return region.polygons();
  const stream::Box3& box = region.box();
  return {{{{box.min[0], box.min[1]},
            {box.max[0], box.min[1]},
            {box.max[0], box.max[1]},
            {box.min[0], box.max[1]}}}};
}

/// A range of shifts by whole turns.
struct Turns {
  double first = 0, last = 0;
};

Turns turns_to(const stream::Box3& box, double turn, const stream::Box3& bounds) {
  if (!(turn > 0)) return {};
  // There are no data beyond this distance.
  constexpr double kMost = 4;
  const Turns turns{std::max(-kMost, std::ceil((bounds.min[0] - box.max[0]) / turn)),
                    std::min(kMost, std::floor((bounds.max[0] - box.min[0]) / turn))};
  return turns.first <= turns.last ? turns : Turns{};
}

/// Ends unbounded latitudes just beyond the data, because outlines must be finite.
Region within_reach(stream::Box3 box, const stream::Box3& bounds) {
  box.min[1] = std::max(box.min[1], std::min(bounds.min[1] - 1, box.max[1]));
  box.max[1] = std::min(box.max[1], std::max(bounds.max[1] + 1, box.min[1]));
  return Region::of_box(box);
}

stream::Box3 widened(stream::Box3 box, const Point2& by) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    box.min[axis] -= by[axis];
    box.max[axis] += by[axis];
  }
  return box;
}

}  // namespace

Region region_in(const Region& region, const Transformation& change, const stream::Box3& bounds) {
  const CoordinateSystem& to = change.from();
  const Outline outline(change);
  std::vector<Polygon> polygons;
  for (Polygon& polygon : outlines(region)) {
    for (std::vector<Point2>& ring : polygon) ring = outline.ring(ring);
    // Sides may coincide, as the meridians of 180 degrees east and west do.
    for (Polygon& part : valid_polygons(polygon)) polygons.push_back(std::move(part));
  }
  if (polygons.empty()) throw fault(to, "the region has no area in");
  const Region target =
      Region::of_polygons(std::move(polygons), region.box().min[2], region.box().max[2]);
  return with_turns(target, to.turn(), bounds);
}

Point2 middle_in(const Transformation& change, const stream::Box3& box) {
  Point2 middle{0.5 * (box.min[0] + box.max[0]), 0.5 * (box.min[1] + box.max[1])};
  change.forward({&middle, 1});
  return middle;
}

Region with_turns(const Region& region, double turn, const stream::Box3& bounds,
                  const Point2& tolerance) {
  const stream::Box3& bounding_box = region.box();
  const bool box = region.polygons().empty();
  // A box wider than two turns, such as an infinite one, is used as written.
  if (box && !(bounding_box.max[0] - bounding_box.min[0] <= 2 * turn)) turn = 0;
  // Shifting by whole turns rounds as well.
  Point2 rounding{0x1p-50 * turn, 0};
  const auto [first, last] =
      turns_to(widened(widened(bounding_box, tolerance), rounding), turn, bounds);
  if (first == 0 && last == 0) rounding[0] = 0;
  stream::Box3 extent = widened(bounding_box, rounding);
  extent.min[0] += first * turn;
  extent.max[0] += last * turn;
  if (box && (first == last || bounding_box.max[0] - bounding_box.min[0] >= turn)) {
    return Region::of_box(widened(extent, tolerance)).with_extent(extent);
  }
  if (first == 0 && last == 0) return region;
  const std::vector<Polygon> one = outlines(
      box ? within_reach(widened(widened(bounding_box, rounding), tolerance), bounds) : region);
  std::vector<Polygon> polygons;
  for (double i = first; i <= last; ++i) {
    for (Polygon polygon : one) {
      stream::Box3 around;
      for (std::vector<Point2>& ring : polygon) {
        for (Point2& p : ring) {
          p[0] += i * turn;
          around.include(stream::Point3{p[0], p[1], 0});
        }
      }
      // Only some of several polygons may be near the data.
      if (around.min[0] <= bounds.max[0] && around.max[0] >= bounds.min[0]) {
        polygons.push_back(std::move(polygon));
      }
    }
  }
  if (polygons.empty()) return region;
  const Region converted =
      Region::of_polygons(std::move(polygons), bounding_box.min[2], bounding_box.max[2]);
  return box ? converted.with_extent(extent) : converted;
}

}  // namespace terrace::terrain
