// SPDX-License-Identifier: Apache-2.0
#include "surface/bounded/bounded_surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <terrace/stream/error.hpp>
#include <terrace/tri/predicates.hpp>

#include "base/available_memory.hpp"
#include "base/units.hpp"
#include "earth/ground.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// Returns the range of x in which a triangle is between two values of y.
std::array<double, 2> range_between(const SurfaceTriangle& t, double low, double high) {
  double first = INFINITY, last = -INFINITY;
  const auto include = [&](double x) {
    first = std::min(first, x);
    last = std::max(last, x);
  };
  for (std::size_t i = 0; i < 3; ++i) {
    const Point2 &a = t[i].place, &b = t[(i + 1) % 3].place;
    if (a[1] >= low && a[1] <= high) include(a[0]);
    for (const double y : {low, high}) {
      if ((a[1] < y) == (b[1] < y)) continue;
      const double share = (y - a[1]) / (b[1] - a[1]);
      include(a[0] + share * (b[0] - a[0]));
    }
  }
  return {first, last};
}

}  // namespace

BoundedPart::BoundedPart(std::vector<SurfaceCorner> vertices, std::vector<Triangle> triangles,
                         std::vector<std::uint32_t> last_window)
    : vertices_(std::move(vertices)),
      triangles_(std::move(triangles)),
      last_window_(std::move(last_window)) {
  for (const SurfaceCorner& v : vertices_) box_.include(v.place);
  side_ = static_cast<std::size_t>(std::sqrt(static_cast<double>(triangles_.size()))) + 1;
  for (Triangle& t : triangles_) {
    const SurfaceTriangle c = corners(t);
    if (tri::orientation(c[0].place, c[1].place, c[2].place) < 0) std::swap(t[1], t[2]);
  }
  // More than the rounding of any coordinate below.
  double margin = 0;
  for (const Point2& corner : {box_.min, box_.max}) {
    for (const double c : corner) margin = std::max(margin, 1e-9 * std::abs(c));
  }
  const auto for_each_cell = [&](const Triangle& t, const auto& visit) {
    const SurfaceTriangle c = corners(t);
    const auto [low, high] = std::minmax({c[0].place[1], c[1].place[1], c[2].place[1]});
    const double height = (box_.max[1] - box_.min[1]) / static_cast<double>(side_);
    const std::size_t end = cell(high + margin, 1);
    for (std::size_t row = cell(low - margin, 1); row <= end; ++row) {
      const double bottom = box_.min[1] + static_cast<double>(row) * height - margin;
      const auto [first, last] = range_between(c, bottom, bottom + height + 2 * margin);
      if (!(first <= last)) continue;
      const std::size_t last_column = cell(last + margin, 0);
      for (std::size_t column = cell(first - margin, 0); column <= last_column; ++column) {
        visit(row * side_ + column);
      }
    }
  };
  begin_.assign(side_ * side_ + 1, 0);
  for (const Triangle& t : triangles_) for_each_cell(t, [&](std::size_t at) { ++begin_[at + 1]; });
  for (std::size_t at = 0; at + 1 < begin_.size(); ++at) begin_[at + 1] += begin_[at];
  listed_.resize(begin_.back());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
    for_each_cell(triangles_[i], [&](std::size_t at) { listed_[next[at]++] = i; });
  }
}

std::size_t BoundedPart::cell(double coordinate, std::size_t axis) const {
  const double size = box_.max[axis] - box_.min[axis];
  const double at = (coordinate - box_.min[axis]) / size * static_cast<double>(side_);
  // `at > 0` also excludes NaN, for a box without a size.
  return at > 0 ? static_cast<std::size_t>(std::min(at, static_cast<double>(side_ - 1))) : 0;
}

void BoundedPart::append_at(const Point2& place, std::vector<SurfaceTriangle>& out) const {
  if (triangles_.empty() || !box_.contains(place)) return;
  const std::size_t at = cell(place[1], 1) * side_ + cell(place[0], 0);
  for (std::uint32_t k = begin_[at]; k < begin_[at + 1]; ++k) {
    const SurfaceTriangle t = corners(triangles_[listed_[k]]);
    const auto is_left = [&](std::size_t i, std::size_t j) {
      return tri::orientation(t[i].place, t[j].place, place) >= 0;
    };
    if (is_left(0, 1) && is_left(1, 2) && is_left(2, 0)) out.push_back(t);
  }
}

std::size_t BoundedPart::bytes() const {
  return sizeof(BoundedPart) + vertices_.size() * (sizeof(SurfaceCorner) + sizeof(std::uint32_t)) +
         triangles_.size() * sizeof(Triangle) +
         (begin_.size() + listed_.size()) * sizeof(std::uint32_t);
}

unsigned BoundedSurface::threads_within(std::uint64_t memory_bytes, unsigned threads) const {
  if (memory_bytes < bytes_per_window_) {
    throw stream::Error(
        store_.path().string(),
        stream::message("a surface within {max_error} needs {} of memory, {memory_bytes} allows {}",
                        readable_bytes(kProcessBytes + 2 * bytes_per_window_),
                        readable_bytes(kProcessBytes + 2 * memory_bytes)))
        .remedy("allow more");
  }
  return static_cast<unsigned>(
      std::clamp<std::uint64_t>(memory_bytes / bytes_per_window_, 1, std::max(1U, threads)));
}

std::unique_ptr<BoundedSurface> bounded_surface(const stream::Store& store, double max_error) {
  if (!(max_error >= 0) || !std::isfinite(max_error)) {
    throw UsageError(stream::message("{max_error} must be a number of metres, 0 or more"));
  }
  const stream::Placement& placement = store.schema();
  const double metres_vertical =
      Ground(placement).map(store.bounds())[8] / placement.coordinates[2].scale;
  const double bound = max_error / metres_vertical;
  return store.schema().grid ? bounded_raster(store, bound) : bounded_cloud(store, bound);
}

void need_bound_alone(unsigned level, std::span<const FinerRegion> focuses,
                      const std::optional<double>& max_edge) {
  if (level != 0 || !focuses.empty()) {
    throw UsageError(
        stream::message("{max_error} chooses among all samples: leave {level} and {focus} out"));
  }
  if (max_edge) {
    throw UsageError(stream::message(
        "{max_edge} does not apply with {max_error}, whose triangles are long where the ground is "
        "even: leave one of them out"));
  }
}

std::shared_ptr<const BoundedPart> BoundedParts::operator()(std::uint32_t window) {
  {
    const std::lock_guard lock(mutex_);
    for (const auto* parts : {&recent_, &older_}) {
      if (const auto found = parts->find(window); found != parts->end()) return found->second;
    }
  }
  auto part = std::make_shared<const BoundedPart>(surface_->mesh(window));
  const std::lock_guard lock(mutex_);
  if (recent_bytes_ + part->bytes() > max_bytes_ / 2) {
    older_ = std::exchange(recent_, {});
    recent_bytes_ = 0;
  }
  if (recent_.try_emplace(window, part).second) recent_bytes_ += part->bytes();
  return part;
}

}  // namespace terrace::terrain
