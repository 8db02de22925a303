// SPDX-License-Identifier: Apache-2.0
#include "surface/point_cloud.hpp"

#include <algorithm>
#include <exception>
#include <unordered_set>
#include <utility>

#include "surface/circle_cover.hpp"
#include "surface/point_window.hpp"

namespace terrace::terrain {
namespace {

constexpr std::size_t kPointsPerPart = std::size_t{1} << 16;
/// Testing a box costs about a fiftieth of triangulating a point. So the border is found before the
/// tests have cost as much as finding it.
constexpr std::uint64_t kLooksPerPoint = 16;
/// Peak memory in bytes of a border point: itself, then a vertex with two triangles and their
/// boxes.
constexpr std::uint64_t kBytesPerBorderPoint = 320;
constexpr std::uint64_t kShareOfMemory = 4;

}  // namespace

PointVoids::PointVoids(const stream::Store& store, const WantedClusters& wanted)
    : store_(store),
      wanted_(wanted),
      max_looks_(kLooksPerPoint * static_cast<std::uint64_t>(wanted.points(store))) {}

bool PointVoids::count_looks(std::uint64_t boxes) {
  return (looks_ += boxes) > max_looks_ && state_ != State::none;
}

bool PointVoids::find(PointWindow& window) {
  std::unique_lock lock(mutex_);
  const std::uint64_t memory = window.memory_bytes();
  if (!tree_) {
    tree_.emplace(store_, wanted_, kPointsPerPart);
    parts_.resize(tree_->size());
  }
  while (state_ == State::unknown && next_ < parts_.size()) {
    const std::size_t part = next_++;
    ++at_work_;
    lock.unlock();
    Part found;
    bool fits = true;
    std::exception_ptr error;
    try {
      found.reach = window.find_border(tree_->box(part), found.border);
    } catch (const PointWindow::NoRoom&) {
      fits = false;
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    --at_work_;
    points_ += found.border.size();
    fits = fits && (memory == 0 || points_ <= memory / kShareOfMemory / kBytesPerBorderPoint);
    parts_[part] = std::move(found);
    // The other threads must not wait for a part that failed.
    if (error || !fits) state_ = State::none;
    changed_.notify_all();
    if (error) std::rethrow_exception(error);
  }
  changed_.wait(lock, [&] { return at_work_ == 0 || state_ != State::unknown; });
  if (state_ == State::unknown) {
    triangulate();
    // If all points are collinear, the border does not determine which points are neighbours.
    state_ = border_.triangle_count() > 0 ? State::known : State::none;
  }
  return known();
}

void PointVoids::triangulate() {
  std::vector<Point2> places;
  places.reserve(points_);
  for (const Part& part : parts_) {
    for (const SurfaceCorner& corner : part.border) places.push_back(corner.place);
  }
  const std::vector<tri::VertexId> vertices = border_.build(places);
  heights_.resize(border_.vertex_slots());
  std::size_t at = 0;
  for (Part& part : parts_) {
    for (const SurfaceCorner& corner : part.border) {
      heights_[tri::slot(vertices[at++])] = corner.height;
    }
    std::vector<SurfaceCorner>().swap(part.border);
  }
  std::vector<BoxTree::Item>& items = triangles_.start();
  for (const tri::TriangleId t : border_.all_triangles()) {
    const std::array<tri::VertexId, 3> v = border_.vertices(t);
    StoredBox box{border_.point(v[0]), border_.point(v[0])};
    for (std::size_t i = 1; i < 3; ++i) {
      const Point2 p = border_.point(v[i]);
      for (std::size_t k = 0; k < 2; ++k) {
        box.min[k] = std::min(box.min[k], p[k]);
        box.max[k] = std::max(box.max[k], p[k]);
      }
    }
    items.push_back({box, tri::slot(t)});
  }
  triangles_.build();
}

double PointVoids::reach(const StoredBox& box) const {
  double reach = 0;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (!tree_->box(i).widened(parts_[i].reach).intersects(box)) continue;
    reach = std::max(reach, parts_[i].reach);
  }
  return reach;
}

void PointVoids::for_each(const StoredBox& box,
                          const std::function<void(const SurfaceCorner&)>& visit) const {
  std::vector<tri::VertexId> corners;
  triangles_.visit(
      [&](const StoredBox& around) { return around.intersects(box); },
      [&](std::uint32_t number) {
        const std::array<tri::VertexId, 3> v = border_.vertices(tri::TriangleId{number});
        if (!triangle_meets({border_.point(v[0]), border_.point(v[1]), border_.point(v[2])}, box)) {
          return;
        }
        corners.insert(corners.end(), v.begin(), v.end());
      });
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  for (const tri::VertexId v : corners) visit({border_.point(v), heights_[tri::slot(v)]});
}

void PointVoids::for_each_around(const Point2& place,
                                 const std::function<void(const Point2&)>& visit) const {
  const StoredBox box{place, place};
  std::vector<tri::TriangleId> open{border_.locate(place).triangle};
  std::unordered_set<std::uint32_t> reached{tri::slot(open[0])};
  while (!open.empty()) {
    const std::array<tri::VertexId, 3> v = border_.vertices(open.back());
    const std::array<tri::TriangleId, 3> next = border_.neighbours(open.back());
    open.pop_back();
    const std::array<Point2, 3> corner{border_.point(v[0]), border_.point(v[1]),
                                       border_.point(v[2])};
    if (!CircleCover::of_triangle(corner).meets(box)) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      visit(corner[i]);
      if (next[i] != tri::kNoTriangle && reached.insert(tri::slot(next[i])).second) {
        open.push_back(next[i]);
      }
    }
  }
}

}  // namespace terrace::terrain
