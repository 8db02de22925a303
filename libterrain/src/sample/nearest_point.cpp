// SPDX-License-Identifier: Apache-2.0
#include "sample/nearest_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <terrace/tri/delaunay2.hpp>

namespace terrace::terrain {
namespace {

/// More than a square of a distance is wrong by: differences, squares and their sum.
constexpr double kDoubt = 8 * std::numeric_limits<double>::epsilon();

double square_of(double dx, double dy) { return dx * dx + dy * dy; }

}  // namespace

NearestPoint::NearestPoint(const stream::Store& store, unsigned level, std::uint64_t cache_bytes)
    : query_(store, cache_bytes), level_(level) {}

void NearestPoint::add(const Point2& point, const Point2& place) {
  const double square = square_of(point[0] - place[0], point[1] - place[1]);
  if (square > bound_) return;
  // What was near before may be too far now; that is sorted out in the end.
  bound_ = std::min(bound_, square * (1 + kDoubt));
  nearest_.push_back(point);
}

Point2 NearestPoint::operator()(const Point2& place) {
  nearest_.clear();
  // The last answer is no farther than it is; it will be found again if there is nothing nearer.
  bound_ = std::numeric_limits<double>::infinity();
  if (last_) {
    const double square = square_of((*last_)[0] - place[0], (*last_)[1] - place[1]);
    bound_ = square * (1 + kDoubt);
  }
  query_.best_first(
      level_,
      [&place](const stream::Box3& box) {
        // All its points lie at one place, and so does its head, which is known.
        if (box.min[0] == box.max[0] && box.min[1] == box.max[1]) {
          return std::numeric_limits<double>::infinity();
        }
        const auto out = [&](std::size_t k) {
          return std::max({box.min[k] - place[k], place[k] - box.max[k], 0.0});
        };
        return square_of(out(0), out(1)) * (1 - kDoubt);
      },
      [&](const stream::StoreQuery::Node& node) {
        for (const stream::Point3& p : node.positions) add({p[0], p[1]}, place);
        return bound_;
      });
  std::erase_if(nearest_, [&](const Point2& p) {
    return square_of(p[0] - place[0], p[1] - place[1]) > bound_;
  });
  if (nearest_.empty()) return {NAN, NAN};
  last_ = nearest_.front();
  if (std::all_of(nearest_.begin(), nearest_.end(),
                  [&](const Point2& p) { return p == nearest_.front(); })) {
    return nearest_.front();
  }
  // Too close to call with doubles.
  tri::Delaunay2<double> few;
  few.build(nearest_);
  return few.point(few.nearest(place));
}

}  // namespace terrace::terrain
