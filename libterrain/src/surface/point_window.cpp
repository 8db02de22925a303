// SPDX-License-Identifier: GPL-3.0-or-later
#include "surface/point_window.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include <terrace/stream/error.hpp>

namespace terrace::terrain {
namespace {

/// Mean distances of points around the box.
constexpr double kMargin = 3;
/// Few, so that hardly more are looked at than lie near a circle's border; but boxes cost too.
constexpr std::size_t kPointsPerGroup = 16;
/// Peak bytes per point that was read, and more per point that is inserted: the triangulation and
/// its bulk build, heights, origins and states by slots, a hint and a suspect's share.
constexpr std::uint64_t kBytesRead = 2 * 32, kBytesInserted = 68 + 20 + 16 + 8 + 2 * (16 + 4) + 16;
constexpr std::uint64_t kBytesBefore = std::uint64_t{8} << 20;  ///< what reads the store

}  // namespace

PointWindow::PointWindow(const stream::Store& store, unsigned level, std::uint64_t memory_bytes)
    : store_(store),
      memory_bytes_(memory_bytes),
      scale_(store.schema().coordinates[2].scale),
      offset_(store.schema().coordinates[2].offset),
      frontier_(store, level) {}

std::array<Point2, 3> PointWindow::corners(tri::TriangleId triangle) const {
  const auto v = triangulation_.vertices(triangle);
  return {triangulation_.point(v[0]), triangulation_.point(v[1]), triangulation_.point(v[2])};
}

bool PointWindow::stands_before(const Origin& a, const Origin& b) const {
  if (b.cluster == Origin{}.cluster) return true;
  const stream::ClusterId ca = read_[a.cluster], cb = read_[b.cluster];
  if (ca == cb) return a.index < b.index;
  const unsigned la = stream::level_of(ca), lb = stream::level_of(cb);
  return la != lb ? la > lb : ca < cb;
}

void PointWindow::check_memory(std::size_t more) const {
  const std::uint64_t read = pending_.size() + more;
  const std::uint64_t inserted = triangulation_.vertex_count() + taken_.size();
  const std::uint64_t needed =
      read * kBytesRead + inserted * kBytesInserted + kBytesBefore + frontier_.memory_bytes();
  if (memory_bytes_ == 0 || needed <= memory_bytes_) return;
  throw stream::Error(
      {.file = store_.path().string(),
       .where = {},
       .cause = "a window of at least " + std::to_string(read) + " points needs " +
                std::to_string((needed >> 20) + 1) + "M of memory, " +
                std::to_string(memory_bytes_ >> 20) + "M are allowed for it",
       .remedy = "give more `memory_bytes`, fewer `threads`, or a coarser `level`"});
}

void PointWindow::take(const StoreWindow::Node& node) {
  check_memory(node.positions.size());
  const auto cluster = static_cast<std::uint32_t>(read_.size());
  read_.push_back(node.id);
  const std::size_t begin = pending_.size();
  for (std::size_t i = 0; i < node.positions.size(); ++i) {
    const stream::Point3& p = node.positions[i];
    pending_.push_back(
        {{p[0], p[1]}, p[2] * scale_ + offset_, {cluster, static_cast<std::uint32_t>(i)}});
  }
  add_groups(begin, node.positions.size());
}

void PointWindow::add_groups(std::size_t begin, std::size_t count) {
  if (count == 0) return;
  constexpr double kAll = std::numeric_limits<double>::infinity();
  StoredBox box{{kAll, kAll}, {-kAll, -kAll}};
  const std::span<Pending> points(pending_.data() + begin, count);
  for (const Pending& p : points) {
    for (std::size_t k = 0; k < 2; ++k) {
      box.min[k] = std::min(box.min[k], p.place[k]);
      box.max[k] = std::max(box.max[k], p.place[k]);
    }
  }
  const std::size_t at = groups_.size();
  groups_.push_back({box, begin, count, at + 1});
  if (count <= kPointsPerGroup) return;
  groups_[at].count = 0;
  const std::size_t axis = box.max[0] - box.min[0] >= box.max[1] - box.min[1] ? 0 : 1;
  const std::size_t half = count / 2;
  std::nth_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(half), points.end(),
                   [axis](const Pending& a, const Pending& b) {
                     return std::pair(a.place[axis], a.origin.index) <
                            std::pair(b.place[axis], b.origin.index);
                   });
  add_groups(begin, half);
  add_groups(begin + half, count - half);
  groups_[at].next = groups_.size();
}

void PointWindow::move_pending(Group& group, std::size_t at) {
  taken_.push_back(pending_[at]);
  pending_[at] = pending_[group.begin + --group.count];
}

void PointWindow::take_inner() {
  for (Group& group : groups_) {
    if (!group.box.meets(inner_)) continue;
    for (std::size_t at = group.begin; at < group.begin + group.count;) {
      const Triangulation::Point& p = pending_[at].place;
      if (inner_.contains({p[0], p[1], 0})) {
        move_pending(group, at);
      } else {
        ++at;
      }
    }
  }
}

void PointWindow::insert_taken() {
  check_memory(0);
  places_.resize(taken_.size());
  for (std::size_t i = 0; i < taken_.size(); ++i) places_[i] = taken_[i].place;
  inserted_.resize(taken_.size());
  if (triangulation_.vertex_count() == 0) {
    const std::vector<tri::VertexId> built = triangulation_.build(places_);
    for (std::size_t i = 0; i < built.size(); ++i) inserted_[i].vertex = built[i];
  } else {
    triangulation_.insert(places_, inserted_);
  }
  heights_.resize(triangulation_.vertex_slots(), std::numeric_limits<double>::quiet_NaN());
  origins_.resize(triangulation_.vertex_slots());
  states_.resize(triangulation_.triangle_slots(), kUnknown);
  hull_certain_.resize(triangulation_.triangle_slots(), 0);
  for (std::size_t i = 0; i < taken_.size(); ++i) {
    const std::uint32_t at = tri::slot(inserted_[i].vertex);
    if (!stands_before(taken_[i].origin, origins_[at])) continue;
    origins_[at] = taken_[i].origin;
    heights_[at] = taken_[i].height;
  }
  taken_.clear();
}

void PointWindow::clear() {
  triangulation_.stop_journal();
  triangulation_.clear();
  heights_.clear();
  origins_.clear();
  states_.clear();
  hull_certain_.clear();
  read_.clear();
  pending_.clear();
  taken_.clear();
  groups_.clear();
  suspects_.clear();
  suspect_triangles_ = 0;
  hull_.clear();
}

void PointWindow::load(const StoredBox& box, Reach reach) {
  clear();
  box_ = inner_ = box;
  reach_ = reach;
  const StoredBox bounds{{store_.bounds().min[0], store_.bounds().min[1]},
                         {store_.bounds().max[0], store_.bounds().max[1]}};
  if (box.meets(bounds)) {
    const auto take = [this](const StoreWindow::Node& node) { this->take(node); };
    frontier_.begin(take);
    frontier_.read_meeting(box, take);
    // Triangles across the border need a few points more, which are cheaper in bulk.
    const double width = box.max[0] - box.min[0], height = box.max[1] - box.min[1];
    const auto inside =
        static_cast<double>(std::count_if(pending_.begin(), pending_.end(), [&](const Pending& p) {
          return box.contains({p.place[0], p.place[1], 0});
        }));
    const double margin = std::min(kMargin * std::sqrt(width * height / std::max(inside, 1.0)),
                                   0.05 * std::max(width, height));
    inner_ = {{box.min[0] - margin, box.min[1] - margin},
              {box.max[0] + margin, box.max[1] + margin}};
    frontier_.read_meeting(inner_, take);
    take_inner();
    insert_taken();
    triangulation_.start_journal();
    examine_all();
    while (add_missing()) {
      insert_taken();
      examine_changes();
    }
    triangulation_.stop_journal();
  }
  make_hints();
}

}  // namespace terrace::terrain
