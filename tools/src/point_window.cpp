// SPDX-License-Identifier: GPL-3.0-or-later
#include "point_window.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <terrace/stream/error.hpp>

#include "interrupt.hpp"

namespace terrace::tools {
namespace {

using Point = tri::Delaunay2<double>::Point;

/// Peak bytes per point: the triangulation and its bulk build, what was read of it (with room to
/// grow), height, origin and two triangles' flags twice, a hint and a suspect's share.
constexpr std::uint64_t kBytesPerPoint = 68 + 20 + 2 * (16 + 8 + 8 + 8) + 2 * (8 + 8 + 4) + 8 + 8;
constexpr std::uint64_t kBytesBefore = std::uint64_t{8} << 20;  ///< what reads the store

/// Whether a triangle, its corners counter-clockwise, meets a box; sometimes true where it does not
/// by a rounding.
bool meets(const std::array<Point2, 3>& corner, const StoredBox& box) {
  for (std::size_t k = 0; k < 2; ++k) {
    const auto [low, high] = std::minmax({corner[0][k], corner[1][k], corner[2][k]});
    if (low > box.max[k] || high < box.min[k]) return false;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    // Of the sides seen from outside, the inside is to the right.
    if (!HalfPlane{corner[(i + 1) % 3], corner[i]}.meets(box)) return false;
  }
  return true;
}

bool holds(const StoredBox& outer, const StoredBox& inner) {
  return inner.min[0] >= outer.min[0] && inner.min[1] >= outer.min[1] &&
         inner.max[0] <= outer.max[0] && inner.max[1] <= outer.max[1];
}

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

void PointWindow::take(const StoreWindow::Node& node) {
  const std::uint64_t points =
      triangulation_.vertex_count() + taken_.size() + node.positions.size();
  const std::uint64_t needed = points * kBytesPerPoint + kBytesBefore + frontier_.memory_bytes();
  if (memory_bytes_ != 0 && needed > memory_bytes_) {
    throw stream::Error({.file = store_.path().string(),
                         .where = {},
                         .cause = "a window of at least " + std::to_string(points) +
                                  " points needs " + std::to_string((needed >> 20) + 1) +
                                  "M of memory, " + std::to_string(memory_bytes_ >> 20) +
                                  "M are allowed for it",
                         .remedy = "give more --memory, fewer --threads, or a coarser --level"});
  }
  const auto cluster = static_cast<std::uint32_t>(read_.size());
  read_.push_back(node.id);
  for (std::size_t i = 0; i < node.positions.size(); ++i) {
    const stream::Point3& p = node.positions[i];
    taken_.push_back({p[0], p[1]});
    taken_heights_.push_back(p[2] * scale_ + offset_);
    taken_origins_.push_back({cluster, static_cast<std::uint32_t>(i)});
  }
}

void PointWindow::insert_taken() {
  inserted_.resize(taken_.size());
  if (triangulation_.vertex_count() == 0) {
    const std::vector<tri::VertexId> built = triangulation_.build(taken_);
    for (std::size_t i = 0; i < built.size(); ++i) inserted_[i].vertex = built[i];
  } else {
    triangulation_.insert(taken_, inserted_);
  }
  heights_.resize(triangulation_.vertex_slots(), std::numeric_limits<double>::quiet_NaN());
  origins_.resize(triangulation_.vertex_slots());
  certain_.resize(triangulation_.triangle_slots(), 0);
  for (std::size_t i = 0; i < taken_.size(); ++i) {
    const std::uint32_t at = tri::slot(inserted_[i].vertex);
    if (!stands_before(taken_origins_[i], origins_[at])) continue;
    origins_[at] = taken_origins_[i];
    heights_[at] = taken_heights_[i];
  }
  taken_.clear();
  taken_heights_.clear();
  taken_origins_.clear();
}

void PointWindow::load(const StoredBox& box, Reach reach) {
  box_ = inner_ = box;
  reach_ = reach;
  triangulation_.clear();
  heights_.clear();
  origins_.clear();
  certain_.clear();
  read_.clear();
  taken_.clear();
  taken_heights_.clear();
  taken_origins_.clear();
  const auto take = [this](const StoreWindow::Node& node) { this->take(node); };
  frontier_.begin(take);
  const StoredBox bounds{{store_.bounds().min[0], store_.bounds().min[1]},
                         {store_.bounds().max[0], store_.bounds().max[1]}};
  if (box.meets(bounds)) {
    frontier_.read_meeting(box, take);
    // Triangles across the border need a few points more, which are cheaper in bulk.
    const double width = box.max[0] - box.min[0], height = box.max[1] - box.min[1];
    const auto inside =
        static_cast<double>(std::count_if(taken_.begin(), taken_.end(), [&](const Point& p) {
          return box.contains({p[0], p[1], 0});
        }));
    const double margin = std::min(2 * std::sqrt(width * height / std::max(inside, 1.0)),
                                   0.05 * std::max(width, height));
    inner_ = {{box.min[0] - margin, box.min[1] - margin},
              {box.max[0] + margin, box.max[1] + margin}};
    frontier_.read_meeting(inner_, take);
    insert_taken();
    while (read_more()) insert_taken();
  } else {
    // No triangle can meet it.
    taken_.clear();
    taken_heights_.clear();
    taken_origins_.clear();
  }
  make_hints();
}

void PointWindow::find_suspects() {
  suspects_.clear();
  if (reach_ == Reach::kCircles) find_suspect_circles();
  for (const tri::TriangleId t : triangulation_.all_triangles()) {
    const std::uint32_t at = tri::slot(t);
    if (certain_[at] != 0) continue;
    const std::array<Point2, 3> corner = corners(t);
    if (!meets(corner, box_) && (reach_ == Reach::kTriangles || near_circle_[at] == 0)) continue;
    const CircleCover cover = CircleCover::of_triangle(corner[0], corner[1], corner[2]);
    if (holds(inner_, cover.bounds())) {
      certain_[at] = 1;
    } else {
      suspects_.push_back({cover, t});
    }
  }
  find_suspect_hull();
}

void PointWindow::find_suspect_circles() {
  near_circle_.assign(triangulation_.triangle_slots(), 0);
  for (const tri::TriangleId t : triangulation_.all_triangles()) {
    const std::array<Point2, 3> corner = corners(t);
    if (!CircleCover::of_triangle(corner[0], corner[1], corner[2]).meets(box_)) continue;
    near_circle_[tri::slot(t)] = 2;
    for (const tri::TriangleId next : triangulation_.neighbours(t)) {
      if (next == tri::kNoTriangle) continue;
      std::uint8_t& mark = near_circle_[tri::slot(next)];
      mark = std::max<std::uint8_t>(mark, 1);
    }
  }
}

void PointWindow::find_suspect_hull() {
  for (const tri::TriangleId t : triangulation_.all_triangles()) {
    const auto next = triangulation_.neighbours(t);
    for (std::size_t i = 0; i < 3; ++i) {
      if (next[i] != tri::kNoTriangle) continue;
      const std::array<Point2, 3> corner = corners(t);
      const CircleCover cover = CircleCover::of_plane(corner[(i + 1) % 3], corner[(i + 2) % 3]);
      if (cover.meets(box_) || (reach_ == Reach::kCircles && near_circle_[tri::slot(t)] == 2)) {
        suspects_.push_back({cover, tri::kNoTriangle});
      }
    }
  }
}

bool PointWindow::read_more() {
  check_interrupt();
  const auto open = frontier_.open();
  chosen_.clear();
  if (triangulation_.triangle_count() == 0) {
    // Points on one line, or fewer than three: anything may make a triangle of them.
    constexpr std::size_t kAtOnce = 64;
    for (std::uint32_t k = 0; k < open.size() && chosen_.size() < kAtOnce; ++k)
      chosen_.push_back(k);
  } else {
    find_suspects();
    constexpr double kAll = std::numeric_limits<double>::infinity();
    StoredBox around{{kAll, kAll}, {-kAll, -kAll}};
    for (const Suspect& suspect : suspects_) {
      const StoredBox bounds = suspect.cover.bounds();
      for (std::size_t k = 0; k < 2; ++k) {
        around.min[k] = std::min(around.min[k], bounds.min[k]);
        around.max[k] = std::max(around.max[k], bounds.max[k]);
      }
    }
    open_near_.clear();
    for (std::uint32_t k = 0; k < open.size(); ++k) {
      if (open[k].box.meets(around)) open_near_.push_back(k);
    }
    for (const Suspect& suspect : suspects_) {
      // Of the highest level the one that reaches in farthest: what is left afterwards is smaller.
      std::uint32_t best = 0;
      double best_depth = 0;
      int best_level = -1;
      for (const std::uint32_t k : open_near_) {
        if (open[k].level < best_level || !suspect.cover.meets(open[k].box)) continue;
        const double depth = suspect.cover.depth(open[k].box);
        if (open[k].level == best_level && !(depth < best_depth)) continue;
        best = k;
        best_level = open[k].level;
        best_depth = depth;
      }
      if (best_level >= 0) {
        chosen_.push_back(best);
      } else if (suspect.triangle != tri::kNoTriangle) {
        certain_[tri::slot(suspect.triangle)] = 1;
      }
    }
    std::sort(chosen_.begin(), chosen_.end());
    chosen_.erase(std::unique(chosen_.begin(), chosen_.end()), chosen_.end());
  }
  if (chosen_.empty()) return false;
  frontier_.read(chosen_, [this](const StoreWindow::Node& node) { take(node); });
  return true;
}

}  // namespace terrace::tools
