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
    : reader_(store, cache_bytes), root_(store.root()), level_(level) {}

void NearestPoint::add(const Point2& point, const Point2& place) {
  const double square = square_of(point[0] - place[0], point[1] - place[1]);
  if (square > bound_) return;
  // What was near before may be too far now; that is sorted out in the end.
  bound_ = std::min(bound_, square * (1 + kDoubt));
  nearest_.push_back(point);
}

void NearestPoint::look_into(const StoreWindow::Node& node, const Point2& place) {
  const unsigned at = stream::level_of(node.id);
  for (std::size_t i = 0; i < node.positions.size(); ++i) {
    add({node.positions[i][0], node.positions[i][1]}, place);
  }
  if (at <= level_) return;
  for (std::size_t i = 0; i < node.positions.size(); ++i) {
    for (unsigned below = level_; below < at; ++below) {
      const StoredBox& box = node.boxes[i * at + below];
      if (box.min == box.max) continue;  // the point itself, whatever is in it
      const auto out = [&](std::size_t k) {
        return std::max({box.min[k] - place[k], place[k] - box.max[k], 0.0});
      };
      const double least = square_of(out(0), out(1)) * (1 - kDoubt);
      if (least > bound_) continue;
      branches_.push_back({least, stream::cluster_id(below, node.children[i * at + below])});
      std::push_heap(branches_.begin(), branches_.end(),
                     [](const Branch& a, const Branch& b) { return a.least > b.least; });
    }
  }
}

Point2 NearestPoint::operator()(const Point2& place) {
  branches_.clear();
  nearest_.clear();
  // The last answer is no farther than it is; it will be found again if there is nothing nearer.
  bound_ = std::numeric_limits<double>::infinity();
  if (last_) {
    const double square = square_of((*last_)[0] - place[0], (*last_)[1] - place[1]);
    bound_ = square * (1 + kDoubt);
  }
  look_into(reader_.node(root_), place);
  while (!branches_.empty()) {
    std::pop_heap(branches_.begin(), branches_.end(),
                  [](const Branch& a, const Branch& b) { return a.least > b.least; });
    const Branch branch = branches_.back();
    branches_.pop_back();
    if (branch.least > bound_) break;
    look_into(reader_.node(branch.id), place);
  }
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
