// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/ordered_work.hpp"
#include "contour/contour_parts.hpp"
#include "contour/contour_triangles.hpp"
#include "surface/point_window.hpp"
#include "surface/window_tree.hpp"

namespace terrace::terrain {
namespace {

/// A part triangulated; with less memory per thread, fewer threads work.
constexpr std::uint64_t kBytesPerWindow = std::uint64_t{40} << 20;

using Triangle = ContourTriangles::Triangle;
constexpr std::uint32_t kNoPart = ContourTriangles::kNoPart;

/// Triangles that levels cross: those of a part, and such as have no vertex in any part at work.
struct Crossed {
  std::vector<Triangle> own, strange;
};

bool places_less(const Triangle& s, const Triangle& t) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (s[i].place != t[i].place) return s[i].place < t[i].place;
  }
  return false;
}

class PointContours {
 public:
  explicit PointContours(const ContourParts& parts)
      : parts_(parts),
        request_(parts.request),
        ground_(parts.store),
        levels_(request_.interval),
        tree_(parts.store, request_.level, parts.points_per_part),
        rank_(tree_.size(), kNoPart) {
    const stream::Box3& bounds = parts.store.bounds();
    bounds_ = {{bounds.min[0], bounds.min[1]}, {bounds.max[0], bounds.max[1]}};
    StoredBox wanted = bounds_;
    if (request_.region) {
      wanted = box_around(*request_.region, ground_);
      // So that a triangle meets the box if its middle, which is rounded, lies in the region.
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const double margin =
            1e-9 * std::max({std::abs(bounds_.min[axis]), std::abs(bounds_.max[axis]), 1e-300});
        wanted.min[axis] -= margin;
        wanted.max[axis] += margin;
      }
      if (!wanted.meets(bounds_)) throw_region_outside(parts.store);
    }
    for (std::size_t part = 0; part < tree_.size(); ++part) {
      if (!tree_.box(part).meets(wanted)) continue;
      rank_[part] = static_cast<std::uint32_t>(at_work_.size());
      at_work_.push_back(part);
    }
  }

  void draw() {
    const std::uint64_t memory = request_.memory_bytes / 2;
    const auto threads = static_cast<unsigned>(
        std::clamp<std::uint64_t>(memory / kBytesPerWindow, 1, std::max(1U, request_.threads)));
    std::vector<std::unique_ptr<PointWindow>> windows(threads);
    ContourTriangles lines(request_.interval, parts_.emit, parts_.limit);
    std::vector<Triangle> strange;
    in_order(
        at_work_.size(), threads,
        [&](unsigned thread, std::size_t i) {
          std::unique_ptr<PointWindow>& window = windows[thread];
          if (window == nullptr) {
            window = std::make_unique<PointWindow>(parts_.store, request_.level, memory / threads);
          }
          window->load(tree_.box(at_work_[i]));
          return crossed(*window, static_cast<std::uint32_t>(i));
        },
        [&](std::size_t i, const Crossed& triangles) {
          lines.add(triangles.own);
          // Several parts meet such a one.
          const auto middle =
              strange.insert(strange.end(), triangles.strange.begin(), triangles.strange.end());
          std::inplace_merge(strange.begin(), middle, strange.end(), places_less);
          strange.erase(std::unique(strange.begin(), strange.end(),
                                    [](const Triangle& s, const Triangle& t) {
                                      return !places_less(s, t) && !places_less(t, s);
                                    }),
                        strange.end());
          parts_.progress(static_cast<double>(i + 1) / static_cast<double>(at_work_.size()));
        });
    lines.finish(strange);
  }

 private:
  [[nodiscard]] bool wanted(const Triangle& t) const {
    for (std::size_t i = 0; request_.max_edge && i < 3; ++i) {
      if (ground_.metres(t[i].place, t[(i + 1) % 3].place) > *request_.max_edge) return false;
    }
    if (!request_.region) return true;
    Point2 middle{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      middle[axis] = (t[0].place[axis] + t[1].place[axis] + t[2].place[axis]) / 3;
    }
    return holds_place(*request_.region, ground_.world(middle));
  }

  [[nodiscard]] Crossed crossed(const PointWindow& window, std::uint32_t part) const {
    const tri::Delaunay2<double>& whole = window.triangulation();
    std::vector<std::int64_t> level_of(whole.vertex_slots());
    std::vector<std::uint32_t> part_of(whole.vertex_slots());
    for (const tri::VertexId vertex : whole.all_vertices()) {
      level_of[tri::slot(vertex)] = levels_.at_or_above(window.height(vertex));
      part_of[tri::slot(vertex)] = rank_[tree_.window_of(whole.point(vertex))];
    }
    Crossed result;
    for (const tri::TriangleId id : whole.all_triangles()) {
      const std::array<tri::VertexId, 3> vertices = whole.vertices(id);
      const auto level = [&](std::size_t i) { return level_of[tri::slot(vertices[i])]; };
      if (level(0) == level(1) && level(0) == level(2)) continue;
      if (!window.is_certain(id)) continue;
      const auto at = [&](std::size_t i) { return part_of[tri::slot(vertices[i])]; };
      const std::uint32_t first = std::min({at(0), at(1), at(2)});
      if (first != part && first != kNoPart) continue;
      Triangle triangle;
      for (std::size_t i = 0; i < 3; ++i) {
        triangle[i] = {whole.point(vertices[i]), window.height(vertices[i]), level(i), at(i)};
      }
      if (wanted(triangle)) (first == part ? result.own : result.strange).push_back(triangle);
    }
    ContourTriangles::sort(result.own);
    ContourTriangles::sort(result.strange);
    return result;
  }

  const ContourParts& parts_;
  const ContourRequest& request_;
  GroundSlope ground_;
  ContourLevels levels_;
  WindowTree tree_;
  StoredBox bounds_;
  std::vector<std::uint32_t> rank_;   ///< by part: its place in at_work_
  std::vector<std::size_t> at_work_;  ///< parts that meet the region
};

}  // namespace

void draw_point_contours(const ContourParts& parts) {
  if (parts.store.points() == 0) {
    if (parts.request.region) throw_region_outside(parts.store);
    return;
  }
  PointContours(parts).draw();
}

}  // namespace terrace::terrain
