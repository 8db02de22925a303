// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/geomorph.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <vector>

#include "height_patches.hpp"

namespace terrace::tri {
namespace {

constexpr std::uint32_t kAsNow = 0xFFFFFFFFu;

template <class Coord>
Point3 lifted(const std::array<Coord, 2>& point, double height) {
  return {static_cast<double>(point[0]), static_cast<double>(point[1]), height};
}

/// Cells of the plane with a place in them, so that triangles without one are told at once.
class PlaceMask {
 public:
  void clear() { places_.clear(); }
  void add(double x, double y) { places_.push_back({x, y}); }
  void build() {
    cells_.assign(kCells * kCells, false);
    low_ = {kFar, kFar};
    std::array<double, 2> high{-kFar, -kFar};
    for (const auto& place : places_) {
      for (std::size_t k = 0; k < 2; ++k) {
        low_[k] = std::min(low_[k], place[k]);
        high[k] = std::max(high[k], place[k]);
      }
    }
    for (std::size_t k = 0; k < 2; ++k) {
      per_unit_[k] = high[k] > low_[k] ? kCells / (high[k] - low_[k]) : 0.0;
    }
    for (const auto& place : places_) cells_[cell(place, 1) * kCells + cell(place, 0)] = true;
  }
  /// False only if no place lies in the triangle.
  [[nodiscard]] bool meets(const Point3& a, const Point3& b, const Point3& c) const {
    std::array<std::size_t, 2> first{}, last{};
    for (std::size_t k = 0; k < 2; ++k) {
      first[k] = cell({std::min({a[0], b[0], c[0]}), std::min({a[1], b[1], c[1]})}, k);
      last[k] = cell({std::max({a[0], b[0], c[0]}), std::max({a[1], b[1], c[1]})}, k);
    }
    for (std::size_t y = first[1]; y <= last[1]; ++y) {
      for (std::size_t x = first[0]; x <= last[0]; ++x) {
        if (cells_[y * kCells + x]) return true;
      }
    }
    return false;
  }

 private:
  static constexpr std::size_t kCells = 64;
  static constexpr double kFar = std::numeric_limits<double>::max();

  [[nodiscard]] std::size_t cell(const std::array<double, 2>& place, std::size_t k) const {
    const double at = (place[k] - low_[k]) * per_unit_[k];
    return at > 0.0 ? std::min(static_cast<std::size_t>(std::min(at, double{kCells})), kCells - 1)
                    : 0;
  }

  std::vector<std::array<double, 2>> places_;
  std::vector<bool> cells_;
  std::array<double, 2> low_{}, per_unit_{};
};

}  // namespace

template <class Coord>
Geomorph2<Coord>::Geomorph2() : patches_(std::make_unique<HeightPatches>()) {}
template <class Coord>
Geomorph2<Coord>::~Geomorph2() = default;

template <class Coord>
Point3 Geomorph2<Coord>::old_position(const Model& model, VertexId vertex) const {
  const std::uint32_t at = slot(vertex);
  if (at < old_index_.size() && old_index_[at] != kAsNow) return old_positions_[old_index_[at]];
  return lifted(model.triangulation().point(vertex), model.height(vertex));
}

template <class Coord>
void Geomorph2<Coord>::make(const Model& model, const typename Model::Delta& delta,
                            bool with_removed) {
  const auto& changes = delta.changes;
  if (delta.removed_heights.size() != changes.removed_vertices.size() ||
      delta.reassigned_heights.size() != delta.reassigned.size()) {
    throw std::invalid_argument(
        "geomorph: the delta has no old heights; make the model with old_heights");
  }
  added.clear();
  removed.clear();
  reassigned.clear();
  const Delaunay2<Coord>& now = model.triangulation();

  old_index_.resize(std::max<std::size_t>(old_index_.size(), now.vertex_slots()), kAsNow);
  const auto remember = [&](VertexId vertex, const Point3& position) {
    old_index_[slot(vertex)] = static_cast<std::uint32_t>(old_positions_.size());
    old_positions_.push_back(position);
  };
  for (std::size_t i = 0; i < changes.removed_vertices.size(); ++i) {
    remember(changes.removed_vertices[i],
             lifted(changes.removed_points[i], delta.removed_heights[i]));
  }
  for (std::size_t i = 0; i < delta.reassigned.size(); ++i) {
    const VertexId vertex = delta.reassigned[i];
    const Point3 before = lifted(now.point(vertex), delta.reassigned_heights[i]);
    remember(vertex, before);
    reassigned.add(vertex, before, lifted(now.point(vertex), model.height(vertex)));
  }

  // A new vertex lies in a triangle that it destroyed, or outside the old hull.
  patches_->clear();
  PlaceMask mask;
  const auto add = [&](const Point3& a, const Point3& b, const Point3& c) {
    if (mask.meets(a, b, c)) patches_->add(a, b, c);
  };
  for (const VertexId vertex : changes.added_vertices) {
    const Point3 place = lifted(now.point(vertex), 0.0);
    mask.add(place[0], place[1]);
  }
  mask.build();
  for (const std::array<VertexId, 3>& corners : changes.removed_corners) {
    if (changes.added_vertices.empty()) break;
    add(old_position(model, corners[0]), old_position(model, corners[1]),
        old_position(model, corners[2]));
  }
  patches_->build();
  for (const VertexId vertex : changes.added_vertices) {
    const Point3 end = lifted(now.point(vertex), model.height(vertex));
    Point3 start = end;
    start[2] = patches_->height(end[0], end[1]).value_or(end[2]);
    added.add(vertex, start, end);
  }

  patches_->clear();
  mask.clear();
  for (const auto& point : changes.removed_points) {
    mask.add(static_cast<double>(point[0]), static_cast<double>(point[1]));
  }
  if (with_removed) mask.build();
  for (const TriangleId triangle : changes.added_triangles) {
    if (!with_removed || changes.removed_vertices.empty()) break;
    const std::array<VertexId, 3> corners = now.vertices(triangle);
    const auto position = [&](std::size_t i) {
      return lifted(now.point(corners[i]), model.height(corners[i]));
    };
    add(position(0), position(1), position(2));
  }
  patches_->build();
  for (std::size_t i = 0; with_removed && i < changes.removed_vertices.size(); ++i) {
    const Point3 start = lifted(changes.removed_points[i], delta.removed_heights[i]);
    Point3 end = start;
    end[2] = patches_->height(start[0], start[1]).value_or(start[2]);
    removed.add(changes.removed_vertices[i], start, end);
  }

  for (const VertexId vertex : changes.removed_vertices) old_index_[slot(vertex)] = kAsNow;
  for (const VertexId vertex : delta.reassigned) old_index_[slot(vertex)] = kAsNow;
  old_positions_.clear();
}

#ifdef TERRACE_TRI_CORE
template class Geomorph2<std::int32_t>;
#else
template class Geomorph2<double>;
#endif

}  // namespace terrace::tri
