// SPDX-License-Identifier: Apache-2.0
#include "surface/point_window.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>

#include "base/units.hpp"

namespace terrace::terrain {
namespace {

/// Width of the margin in mean distances of points around the box.
constexpr double kMargin = 3;
/// Limit of the margin as a share of the longer side.
constexpr double kMaxMargin = 0.05;
/// Circles border voids if they are wider than this many medians, or than this share of the longer
/// side.
constexpr double kWidest = 4, kMaxWidth = 1.0 / 16;
/// Peak memory in bytes per point that was read but is outside. An inserted point has its place,
/// height and origin twice during insertion, 20 bytes for sorting and then 68 in the triangulation,
/// states, a hint and a share of a suspect.
constexpr std::uint64_t kBytesRead = 2 * 32;
constexpr std::uint64_t kBytesBefore = std::uint64_t{8} << 20;  ///< for reading the store
/// Memory of taken points is kept for the next window up to this share of the allowed memory,
/// because page faults are expensive.
constexpr std::uint64_t kShareKept = 16;

}  // namespace

PointWindow::PointWindow(PointCloud& cloud, std::uint64_t memory_bytes)
    : cloud_(cloud),
      memory_bytes_(memory_bytes),
      scale_(cloud.store.schema().coordinates[2].scale),
      offset_(cloud.store.schema().coordinates[2].offset),
      frontier_(cloud.store, cloud.wanted) {}

SurfaceCorner PointWindow::corner(tri::VertexId vertex) const {
  return {triangulation_.point(vertex), height(vertex)};
}

SurfaceTriangle PointWindow::corners_with_heights(tri::TriangleId t) const {
  const auto v = triangulation_.vertices(t);
  return {corner(v[0]), corner(v[1]), corner(v[2])};
}

std::array<Point2, 3> PointWindow::corners(tri::TriangleId triangle) const {
  const auto v = triangulation_.vertices(triangle);
  return {triangulation_.point(v[0]), triangulation_.point(v[1]), triangulation_.point(v[2])};
}

bool PointWindow::precedes(const Origin& a, const Origin& b) const {
  if (b.cluster == kNowhere) return true;
  const stream::ClusterId ca = read_[a.cluster], cb = read_[b.cluster];
  if (ca == cb) return a.index < b.index;
  const unsigned la = stream::level_of(ca), lb = stream::level_of(cb);
  return la != lb ? la > lb : ca < cb;
}

void PointWindow::check_memory(std::size_t more) const {
  const std::uint64_t around = pending_.size();
  const std::uint64_t inserted = triangulation_.vertex_count() + places_.size() + more;
  const std::uint64_t needed = around * kBytesRead + inserted * kBytesPerPoint + kBytesBefore +
                               frontier_.memory_bytes() + outer_.capacity() * sizeof(Outer) +
                               groups_.memory_bytes() + outer_tree_.memory_bytes() +
                               open_tree_.memory_bytes();
  if (memory_bytes_ == 0 || needed <= memory_bytes_) return;
  throw NoRoom({.file = cloud_.store.path().string(),
                .cause = fmt::format(
                    "a window of at least {} needs {}M of memory, {}M are allowed for it",
                    counted(around + inserted, "point"), (needed >> 20) + 1, memory_bytes_ >> 20),
                .remedy = stream::message(
                    "give more {memory_bytes}, fewer {threads}, or a coarser {level}")});
}

void PointWindow::take(const stream::StoreQuery::Node& node) {
  check_memory(node.positions.size());
  const auto cluster = static_cast<std::uint32_t>(read_.size());
  read_.push_back(node.id);
  Outer outer{.box = {}, .begin = pending_.size()};
  for (std::size_t i = 0; i < node.positions.size(); ++i) {
    const stream::Point3& p = node.positions[i];
    const Origin origin{cluster, static_cast<std::uint32_t>(i)};
    const double height = p[2] * scale_ + offset_;
    if (inner_.contains(flat(p))) {
      places_.push_back({p[0], p[1]});
      new_points_.push_back({height, origin});
      continue;
    }
    pending_.push_back({{p[0], p[1]}, height, origin});
    outer.box.include(pending_.back().place);
  }
  outer.count = pending_.size() - outer.begin;
  pending_count_ += outer.count;
  if (outer.count > 0) outer_.push_back(outer);
}

void PointWindow::take(Pending& point) {
  places_.push_back(point.place);
  new_points_.push_back({point.height, point.origin});
  point.origin.cluster = kNowhere;
  --pending_count_;
}

void PointWindow::grow_inner(const StoredBox& box) {
  inner_ = box;
  for (const Outer& outer : outer_) {
    if (!outer.box.intersects(inner_)) continue;
    for (std::size_t i = outer.begin; i < outer.begin + outer.count; ++i) {
      Pending& p = pending_[i];
      if (p.origin.cluster != kNowhere && inner_.contains(p.place)) take(p);
    }
  }
  frontier_.read_meeting(inner_, [this](const stream::StoreQuery::Node& node) { take(node); });
}

bool PointWindow::keeps_buffer() const {
  return new_points_.capacity() * (sizeof(Triangulation::Point) + sizeof(NewPoint)) <=
         memory_bytes_ / kShareKept;
}

void PointWindow::insert_new_points() {
  check_memory(0);
  inserted_.clear();
  std::vector<tri::VertexId> built;
  const bool is_first = triangulation_.vertex_count() == 0;
  if (is_first) {
    triangulation_.set_check_stop([this] { cloud_.store.check_stop(); });
    built = triangulation_.build(places_);
    if (keeps_buffer()) {
      places_.clear();
    } else {
      std::vector<Triangulation::Point>().swap(places_);
    }
  } else {
    inserted_.resize(places_.size());
    triangulation_.insert(places_, inserted_);
    places_.clear();
  }
  heights_.resize(triangulation_.vertex_slots(), kUnknownHeight);
  origins_.resize(triangulation_.vertex_slots());
  for (std::size_t i = 0; i < new_points_.size(); ++i) {
    const std::uint32_t at = tri::slot(is_first ? built[i] : inserted_[i].vertex);
    if (!precedes(new_points_[i].origin, origins_[at])) continue;
    origins_[at] = new_points_[i].origin;
    heights_[at] = new_points_[i].height;
  }
  if (!is_first || keeps_buffer()) {
    new_points_.clear();
  } else {
    std::vector<NewPoint>().swap(new_points_);
  }
}

void PointWindow::clear() {
  triangulation_.restart();
  is_complete_ = takes_too_long_ = false;
  heights_.clear();
  origins_.clear();
  states_.clear();
  read_.clear();
  places_.clear();
  new_points_.clear();
  pending_.clear();
  pending_count_ = 0;
  outer_.clear();
  groups_.clear();
  read_in_trees_ = 0;
  suspects_.clear();
}

double PointWindow::margin() const {
  const double width = box_.max[0] - box_.min[0], height = box_.max[1] - box_.min[1];
  const auto inside = static_cast<double>(std::max<std::size_t>(places_.size(), 1));
  return std::min(kMargin * std::sqrt(width * height / inside),
                  kMaxMargin * std::max(width, height));
}

void PointWindow::begin(const StoredBox& box) {
  clear();
  box_ = inner_ = box;
  const auto take = [this](const stream::StoreQuery::Node& node) { this->take(node); };
  frontier_.begin(take);
  frontier_.read_meeting(box, take);
}

void PointWindow::load(const StoredBox& box) {
  if (!box.intersects(flat(cloud_.store.bounds()))) {
    clear();
    box_ = inner_ = box;
    return;
  }
  const auto load = [&] {
    begin(box);
    if (cloud_.voids.known()) return load_with_border();
    // Triangles across the border need a few more points, which are cheaper in bulk.
    grow_inner(box.widened(margin()));
    insert_new_points();
    is_complete_ = pending_count_ == 0 && frontier_.open().empty();
    if (!is_complete_ && !cloud_.hull.is_flat()) settle();
  };
  load();
  if (takes_too_long_) {
    cloud_.voids.find(*this);
    load();
  }
}

void PointWindow::take_distant(const SurfaceCorner& corner) {
  if (inner_.contains(corner.place)) return;
  places_.push_back(corner.place);
  new_points_.push_back({corner.height, {}});
}

void PointWindow::load_with_border() {
  grow_inner(box_.widened(cloud_.voids.reach(box_)));
  insert_new_points();
  cloud_.voids.for_each(box_, [this](const SurfaceCorner& corner) { take_distant(corner); });
  insert_new_points();
  states_.assign(triangulation_.triangle_slots(), State::unknown);
  for (const tri::TriangleId t : triangulation_.all_triangles()) {
    if (inner_.covers(circle(t).bounds()) || triangle_meets(corners(t), box_)) {
      states_[tri::slot(t)] = State::certain;
    }
  }
}

double PointWindow::find_border(const StoredBox& box, std::vector<SurfaceCorner>& border) {
  begin(box);
  const double margin = this->margin();
  grow_inner(box.widened(margin));
  if (places_.empty()) return 0;
  insert_new_points();
  const auto is_inside = [&](tri::VertexId v) {
    const Point2 p = triangulation_.point(v);
    return box.contains(p);
  };
  // With evenly spread points, one circle in a thousand million is this wide.
  std::vector<double> radii;
  for (const tri::TriangleId t : triangulation_.all_triangles()) {
    const CircleCover cover = circle(t);
    if (!cover.has_plane && is_inside(triangulation_.vertices(t)[0])) radii.push_back(cover.radius);
  }
  double radius = 0;
  if (!radii.empty()) {
    const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
    std::nth_element(radii.begin(), middle, radii.end());
    const double side = std::max(box.max[0] - box.min[0], box.max[1] - box.min[1]);
    radius = std::min(kWidest * *middle, kMaxWidth * side);
  }
  // Slightly more, for rounding.
  const double reach = 2 * radius * (1 + 1e-6);
  grow_inner(box.widened(std::max(margin, reach)));
  insert_new_points();
  std::vector<bool> is_border(triangulation_.vertex_slots(), triangulation_.triangle_count() == 0);
  for (const tri::TriangleId t : triangulation_.all_triangles()) {
    const CircleCover cover = circle(t);
    const auto next = triangulation_.neighbours(t);
    const bool is_narrow = !cover.has_plane && cover.radius <= radius;
    if (is_narrow && std::find(next.begin(), next.end(), tri::kNoTriangle) == next.end()) continue;
    for (const tri::VertexId v : triangulation_.vertices(t)) is_border[tri::slot(v)] = true;
  }
  for (const tri::VertexId v : triangulation_.all_vertices()) {
    if (is_border[tri::slot(v)] && is_inside(v)) border.push_back(corner(v));
  }
  return reach;
}

}  // namespace terrace::terrain
