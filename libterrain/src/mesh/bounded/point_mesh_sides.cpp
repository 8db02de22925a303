// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/point_mesh_sides.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mesh/bounded/local_surface.hpp"

namespace terrace::terrain {
namespace {

/// Share of the bound that sides are settled to: the rest is left to the triangles at them.
constexpr double kPointSideShare = 0.9;
/// How far samples that settle a side lie from it, in distances of neighbours.
constexpr double kReach = 3.0;
/// More samples than this around a knot are not looked at.
constexpr std::size_t kManySamples = 20000;

std::optional<double> nearest_height(const MeshSamples& samples, const Point2& place) {
  double best = std::numeric_limits<double>::infinity();
  std::optional<double> height;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double x = samples.x[i] - place[0], y = samples.y[i] - place[1];
    const double distance = x * x + y * y;
    if (distance < best) {
      best = distance;
      height = samples.z[i];
    }
  }
  return height;
}

}  // namespace

PointMeshSides::PointMeshSides(const PointMeshPlan& plan, PointMeshSamples& samples,
                               tri::PointDuplicates duplicates, double max_error)
    : plan_(plan),
      samples_(samples),
      duplicates_(duplicates),
      side_error_(kPointSideShare * max_error),
      windows_at_(plan.knots.size()),
      known_(plan.sides.size()),
      heights_(plan.knots.size()) {
  for (const PointMeshPlan::Side& side : plan.sides) {
    for (const std::uint32_t knot : side.knots) {
      std::vector<std::uint32_t>& windows = windows_at_[knot];
      windows.insert(windows.end(), side.windows.begin(), side.windows.end());
      std::sort(windows.begin(), windows.end());
      windows.erase(std::unique(windows.begin(), windows.end()), windows.end());
    }
  }
}

std::shared_ptr<const SideVertices> PointMeshSides::vertices(std::uint32_t side) {
  {
    const std::lock_guard lock(mutex_);
    if (known_[side]) return known_[side];
  }
  // Two threads may both do it; they find the same.
  auto settled = std::make_shared<const SideVertices>(settle(plan_.sides[side]));
  const std::lock_guard lock(mutex_);
  if (!known_[side]) known_[side] = std::move(settled);
  return known_[side];
}

void PointMeshSides::drop(std::uint32_t side) {
  const std::lock_guard lock(mutex_);
  known_[side].reset();
}

double PointMeshSides::height_at(std::uint32_t knot) {
  {
    const std::lock_guard lock(mutex_);
    if (heights_[knot]) return *heights_[knot];
  }
  const double height = settle_knot(knot);
  const std::lock_guard lock(mutex_);
  heights_[knot] = height;
  return height;
}

double PointMeshSides::settle_knot(std::uint32_t knot) const {
  const Point2 place = plan_.knots[knot].place;
  double reach = std::numeric_limits<double>::infinity(), most = 0.0;
  for (const std::uint32_t w : windows_at_[knot]) {
    const double spacing = plan_.windows[w].spacing;
    if (spacing > 0.0) reach = std::min(reach, 2.0 * spacing);
    most = std::max(most, spacing * plan_.windows[w].samples);
  }
  MeshSamples around;
  for (;; reach *= 2.0) {
    const PlaneBox box{{place[0] - reach, place[1] - reach}, {place[0] + reach, place[1] + reach}};
    around = {};
    for (const std::uint32_t w : windows_at_[knot]) {
      samples_.read(plan_.windows[w].first_cell, plan_.windows[w].cells, box, around);
    }
    if (around.size() >= 3) {
      if (const auto height = LocalSurface(around, duplicates_).height(place)) return *height;
    }
    if (around.size() > kManySamples || !(reach < most)) break;
  }
  return nearest_height(around, place).value_or(0.0);
}

MeshSamples PointMeshSides::near_side(const PointMeshPlan::Side& side) const {
  MeshSamples near;
  for (const std::size_t upper : {0U, 1U}) {
    const PointMeshPlan::Window& window = plan_.windows[side.windows[upper]];
    const double reach = kReach * window.spacing;
    PlaneBox strip;
    strip.min[side.axis] = side.line - reach;
    strip.max[side.axis] = side.line + reach;
    strip.min[1 - side.axis] = plan_.knots[side.knots[0]].place[1 - side.axis] - reach;
    strip.max[1 - side.axis] = plan_.knots[side.knots[1]].place[1 - side.axis] + reach;
    samples_.read(window.first_cell, window.cells, strip, near);
  }
  return near;
}

SideVertices PointMeshSides::settle(const PointMeshPlan::Side& side) {
  const MeshSamples near = near_side(side);
  const double from = plan_.knots[side.knots[0]].place[1 - side.axis];
  const double to = plan_.knots[side.knots[1]].place[1 - side.axis];
  std::vector<ProfilePlace> profile;
  if (near.size() >= 3) profile = LocalSurface(near, duplicates_).profile(side.axis, side.line);

  const auto end_height = [&](std::size_t end) {
    const std::uint32_t knot = side.knots[end];
    if (plan_.knots[knot].at_hull) {
      // Beyond the last samples: as high as they are.
      if (!profile.empty()) return (end == 0 ? profile.front() : profile.back()).height;
      const auto height = nearest_height(near, plan_.knots[knot].place);
      if (height) return *height;
    }
    return height_at(knot);
  };
  std::vector<double> at{from}, height{end_height(0)};
  std::vector<char> sample{1};
  for (const ProfilePlace& p : profile) {
    if (!(p.at > from && p.at < to)) continue;
    at.push_back(p.at);
    height.push_back(p.height);
    sample.push_back(p.sample ? 1 : 0);
  }
  at.push_back(to);
  height.push_back(end_height(1));
  sample.push_back(1);
  SideVertices vertices;
  if (!(side_error_ > 0.0)) {
    // A sample on the line that is no vertex would be off by a rounding error.
    for (std::size_t i = 0; i < at.size(); ++i) {
      const bool level = sample[i] == 0 && height[i] == height[i - 1] && height[i] == height[i + 1];
      if (!level) vertices.push_back({at[i], height[i]});
    }
    return vertices;
  }
  for (const tri::LineVertex& v : tri::simplify_line(at, height, side_error_).vertices) {
    vertices.push_back({v.t, v.height});
  }
  return vertices;
}

}  // namespace terrace::terrain
