// SPDX-License-Identifier: Apache-2.0
#include "surface/bounded/point_windows.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include <terrace/tri/delaunay2.hpp>

#include "base/streaming_hull.hpp"

namespace terrace::terrain {
namespace {

using Merge = std::function<bool(std::uint32_t first, std::uint32_t cells)>;

class Planner {
 public:
  Planner(const PointMeshCuts& cuts, std::span<const Point2> hull, const Merge& merge)
      : tree_(cuts), hull_(hull), merge_(merge) {}

  PointMeshPlan make() {
    Part root;
    root.corners.assign(hull_.begin(), hull_.end());
    divide(tree_.root, std::move(root));
    add_sides();
    return std::move(plan_);
  }

 private:
  struct Cut {
    unsigned axis = 0;
    double line = 0.0;
    std::map<double, std::uint32_t> junctions;  ///< by their position along the line
  };
  /// The cuts at the lower and the upper border, per axis.
  using Borders = std::array<std::array<std::uint32_t, 2>, 2>;
  struct Part {
    PlaneBox box;
    Borders cuts{{{kNoNumber, kNoNumber}, {kNoNumber, kNoNumber}}};
    std::vector<Point2> corners;
  };

  void divide(std::uint32_t at, Part part);
  std::uint32_t add_cut(const Part& part, unsigned axis, double line);
  void add_window(std::uint32_t first, std::uint32_t cells, Part part);
  void add_sides();

  const PointMeshCuts& tree_;
  std::span<const Point2> hull_;
  const Merge& merge_;
  std::vector<Cut> cuts_;
  std::vector<Borders> window_cuts_;
  PointMeshPlan plan_;
};

void Planner::divide(std::uint32_t at, Part part) {
  if (at >= PointMeshCuts::kCell) return add_window(at - PointMeshCuts::kCell, 1, std::move(part));
  const PointMeshCuts::Node& node = tree_.nodes[at];
  if (merge_(node.first_cell, node.cells)) {
    return add_window(node.first_cell, node.cells, std::move(part));
  }
  const std::uint32_t cut = add_cut(part, node.axis, node.line);
  const auto below = [&](const Point2& p) { return p[node.axis] < node.line; };
  Part lower = part, upper = std::move(part);
  lower.box.max[node.axis] = upper.box.min[node.axis] = node.line;
  lower.cuts[node.axis][1] = upper.cuts[node.axis][0] = cut;
  std::erase_if(lower.corners, [&](const Point2& p) { return !below(p); });
  std::erase_if(upper.corners, below);
  divide(node.next[0], std::move(lower));
  divide(node.next[1], std::move(upper));
}

std::uint32_t Planner::add_cut(const Part& part, unsigned axis, double line) {
  const auto number = static_cast<std::uint32_t>(cuts_.size());
  Cut cut{.axis = axis, .line = line, .junctions = {}};
  const unsigned along = 1 - axis;
  const auto ends = crossings(hull_, axis, line);
  for (const unsigned upper : {0U, 1U}) {
    const double border = upper != 0 ? part.box.max[along] : part.box.min[along];
    const std::uint32_t ancestor = part.cuts[along][upper];
    const double crossing = (*ends)[upper];
    const auto at = [&](double t) { return along == 0 ? Point2{t, line} : Point2{line, t}; };
    // The line ends at the ancestor unless rounding puts that beyond the hull.
    const bool meets =
        ancestor != kNoNumber && (upper != 0 ? border <= crossing : border >= crossing);
    const Point2 position = at(meets ? border : crossing);
    if (meets) {
      const auto [entry, is_new] = cuts_[ancestor].junctions.try_emplace(
          line, static_cast<std::uint32_t>(plan_.junctions.size()));
      if (is_new) plan_.junctions.push_back({position, false, 0});
      cut.junctions[border] = entry->second;
    } else {
      cut.junctions[crossing] = static_cast<std::uint32_t>(plan_.junctions.size());
      plan_.junctions.push_back({position, true, 0});
    }
  }
  cuts_.push_back(std::move(cut));
  return number;
}

void Planner::add_window(std::uint32_t first, std::uint32_t cells, Part part) {
  PointMeshPlan::Window window;
  window.box = part.box;
  window.first_cell = first;
  window.cells = cells;
  for (std::uint32_t i = first; i < first + cells; ++i) {
    const PointMeshCuts::Cell& cell = tree_.cells[i];
    window.samples += cell.samples;
    window.spacing += cell.spacing * cell.samples;
  }
  window.spacing /= window.samples;
  window.hull_corners = std::move(part.corners);
  plan_.windows.push_back(std::move(window));
  window_cuts_.push_back(part.cuts);
}

void Planner::add_sides() {
  std::map<std::array<std::uint32_t, 2>, std::uint32_t> by_junctions;
  for (std::uint32_t w = 0; w < plan_.windows.size(); ++w) {
    PointMeshPlan::Window& window = plan_.windows[w];
    for (const unsigned axis : {0U, 1U}) {
      for (const unsigned upper : {0U, 1U}) {
        const std::uint32_t number = window_cuts_[w][axis][upper];
        if (number == kNoNumber) continue;
        const Cut& cut = cuts_[number];
        auto junction = cut.junctions.lower_bound(window.box.min[1 - axis]);
        for (; junction != cut.junctions.end(); ++junction) {
          const auto next = std::next(junction);
          if (next == cut.junctions.end() || next->first > window.box.max[1 - axis]) break;
          const std::array<std::uint32_t, 2> ends{junction->second, next->second};
          const auto [entry, is_new] =
              by_junctions.try_emplace(ends, static_cast<std::uint32_t>(plan_.sides.size()));
          if (is_new) {
            plan_.sides.push_back({.axis = axis,
                                   .coordinate = cut.line,
                                   .junctions = ends,
                                   .windows = {kNoNumber, kNoNumber}});
          }
          plan_.sides[entry->second].windows[1 - upper] = w;
          window.sides.push_back(entry->second);
        }
      }
    }
  }
  // The height at a junction of several sides does not come from one of them.
  std::vector<unsigned> ends(plan_.junctions.size(), 0);
  for (const PointMeshPlan::Side& side : plan_.sides) {
    for (const std::uint32_t junction : side.junctions) {
      if (++ends[junction] > 1) plan_.junctions[junction].at_hull = false;
      plan_.junctions[junction].last_window =
          std::max(plan_.junctions[junction].last_window, side.last_window());
    }
  }
}

/// A position along a line, and the height there.
struct ProfilePlace {
  double at = 0.0, height = 0.0;
  bool sample = false;  ///< whether it is a sample
};

/// The Delaunay triangulation of some samples as a surface.
class LocalSurface {
 public:
  /// duplicates: which of several samples at one position to use.
  LocalSurface(const MeshSamples& samples, tri::PointDuplicates duplicates);

  /// Returns the height at a position, or nullopt outside the samples' hull.
  [[nodiscard]] std::optional<double> height(const Point2& place) const;
  /// Returns the points where edges cross the line `axis` = c (0: x, 1: y), ascending. The surface
  /// is straight between them.
  [[nodiscard]] std::vector<ProfilePlace> profile(unsigned axis, double c) const;

 private:
  tri::Delaunay2<double> delaunay_;
  std::vector<double> heights_;  ///< by vertex slot
};

LocalSurface::LocalSurface(const MeshSamples& samples, tri::PointDuplicates duplicates) {
  std::vector<Point2> places;
  places.reserve(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) places.push_back({samples.x[i], samples.y[i]});
  const std::vector<tri::VertexId> vertices = delaunay_.build(places);
  std::vector<std::uint32_t> order(samples.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return slot(vertices[a]) < slot(vertices[b]);
  });
  heights_.resize(delaunay_.vertex_slots());
  std::vector<double> group;
  for (std::size_t i = 0; i < order.size(); ++i) {
    group.push_back(samples.z[order[i]]);
    const tri::VertexId vertex = vertices[order[i]];
    if (i + 1 < order.size() && vertices[order[i + 1]] == vertex) continue;
    heights_[slot(vertex)] = merged_height(group, duplicates);
    group.clear();
  }
}

std::optional<double> LocalSurface::height(const Point2& place) const {
  const tri::Location location = delaunay_.locate(place);
  if (location.place == tri::Place::vertex) return heights_[slot(location.vertex)];
  if (location.place == tri::Place::outside) return std::nullopt;
  const auto corners = delaunay_.vertices(location.triangle);
  const Point2 a = delaunay_.point(corners[0]);
  const Point2 b = delaunay_.point(corners[1]);
  const Point2 c = delaunay_.point(corners[2]);
  const double bx = b[0] - a[0], by = b[1] - a[1], cx = c[0] - a[0], cy = c[1] - a[1];
  const double px = place[0] - a[0], py = place[1] - a[1];
  const double area = bx * cy - by * cx;
  const double first = heights_[slot(corners[0])];
  if (!(area > 0.0)) return first;  // too thin for doubles
  const double u = std::clamp((px * cy - py * cx) / area, 0.0, 1.0);
  const double v = std::clamp((bx * py - by * px) / area, 0.0, 1.0);
  return first + u * (heights_[slot(corners[1])] - first) +
         v * (heights_[slot(corners[2])] - first);
}

std::vector<ProfilePlace> LocalSurface::profile(unsigned axis, double c) const {
  std::vector<ProfilePlace> places;
  const unsigned along = 1 - axis;
  for (const tri::TriangleId t : delaunay_.all_triangles()) {
    const auto corners = delaunay_.vertices(t);
    const auto neighbours = delaunay_.neighbours(t);
    for (std::size_t i = 0; i < 3; ++i) {
      // Each edge once.
      if (neighbours[i] != tri::kNoTriangle && slot(neighbours[i]) < slot(t)) continue;
      tri::VertexId low = corners[(i + 1) % 3], high = corners[(i + 2) % 3];
      if (delaunay_.point(low)[axis] > delaunay_.point(high)[axis]) std::swap(low, high);
      const Point2 a = delaunay_.point(low), b = delaunay_.point(high);
      if (!(a[axis] < c && c <= b[axis])) continue;
      const double za = heights_[slot(low)], zb = heights_[slot(high)];
      if (b[axis] == c) {
        places.push_back({b[along], zb, true});
        continue;
      }
      const double part = (c - a[axis]) / (b[axis] - a[axis]);
      places.push_back({a[along] + (b[along] - a[along]) * part, za + (zb - za) * part, false});
    }
  }
  std::sort(places.begin(), places.end(), [](const ProfilePlace& p, const ProfilePlace& q) {
    if (p.at != q.at) return p.at < q.at;
    return p.sample != q.sample ? p.sample : p.height < q.height;
  });
  const auto same = [](const ProfilePlace& p, const ProfilePlace& q) { return p.at == q.at; };
  places.erase(std::unique(places.begin(), places.end(), same), places.end());
  return places;
}

/// Share of the error bound for sides. The triangles at the sides use the rest.
constexpr double kPointSideShare = 0.9;
/// Distance from a side within which samples are used, in spacings of the samples.
constexpr double kStripSpacings = 3.0;
/// The search around a junction ends at this many samples.
constexpr std::size_t kMaxSearchedSamples = 20000;

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

PointMeshPlan plan_point_mesh(const PointMeshCuts& cuts, std::span<const Point2> hull,
                              const Merge& merge) {
  return Planner(cuts, hull, merge).make();
}

PointMeshSides::PointMeshSides(const PointMeshPlan& plan, ReadCells read,
                               tri::PointDuplicates duplicates, double max_error,
                               std::size_t max_kept)
    : plan_(plan),
      read_(std::move(read)),
      duplicates_(duplicates),
      side_error_(kPointSideShare * max_error),
      windows_by_junction_(plan.junctions.size()),
      cache_(max_kept),
      heights_(plan.junctions.size()) {
  for (const PointMeshPlan::Side& side : plan.sides) {
    for (const std::uint32_t junction : side.junctions) {
      std::vector<std::uint32_t>& windows = windows_by_junction_[junction];
      windows.insert(windows.end(), side.windows.begin(), side.windows.end());
      std::sort(windows.begin(), windows.end());
      windows.erase(std::unique(windows.begin(), windows.end()), windows.end());
    }
  }
}

double PointMeshSides::height_at(std::uint32_t junction) {
  {
    const std::lock_guard lock(mutex_);
    if (heights_[junction]) return *heights_[junction];
  }
  const double height = compute_height(junction);
  const std::lock_guard lock(mutex_);
  heights_[junction] = height;
  return height;
}

double PointMeshSides::compute_height(std::uint32_t junction) const {
  const Point2 place = plan_.junctions[junction].position;
  double distance = std::numeric_limits<double>::infinity(), limit = 0.0;
  for (const std::uint32_t w : windows_by_junction_[junction]) {
    const double spacing = plan_.windows[w].spacing;
    if (spacing > 0.0) distance = std::min(distance, 2.0 * spacing);
    limit = std::max(limit, spacing * plan_.windows[w].samples);
  }
  MeshSamples around;
  for (;; distance *= 2.0) {
    const PlaneBox box{{place[0] - distance, place[1] - distance},
                       {place[0] + distance, place[1] + distance}};
    around = {};
    for (const std::uint32_t w : windows_by_junction_[junction]) {
      read_(plan_.windows[w].first_cell, plan_.windows[w].cells, box, around);
    }
    if (around.size() >= 3) {
      if (const auto height = LocalSurface(around, duplicates_).height(place)) return *height;
    }
    if (around.size() > kMaxSearchedSamples || !(distance < limit)) break;
  }
  return nearest_height(around, place).value_or(0.0);
}

MeshSamples PointMeshSides::near_side(const PointMeshPlan::Side& side) const {
  MeshSamples near;
  for (const std::size_t upper : {0U, 1U}) {
    const PointMeshPlan::Window& window = plan_.windows[side.windows[upper]];
    const double distance = kStripSpacings * window.spacing;
    PlaneBox strip;
    strip.min[side.axis] = side.coordinate - distance;
    strip.max[side.axis] = side.coordinate + distance;
    strip.min[1 - side.axis] =
        plan_.junctions[side.junctions[0]].position[1 - side.axis] - distance;
    strip.max[1 - side.axis] =
        plan_.junctions[side.junctions[1]].position[1 - side.axis] + distance;
    read_(window.first_cell, window.cells, strip, near);
  }
  return near;
}

SideVertices PointMeshSides::compute_vertices(const PointMeshPlan::Side& side) {
  const MeshSamples near = near_side(side);
  const double from = plan_.junctions[side.junctions[0]].position[1 - side.axis];
  const double to = plan_.junctions[side.junctions[1]].position[1 - side.axis];
  std::vector<ProfilePlace> profile;
  if (near.size() >= 3)
    profile = LocalSurface(near, duplicates_).profile(side.axis, side.coordinate);

  const auto end_height = [&](std::size_t end) {
    const std::uint32_t junction = side.junctions[end];
    if (plan_.junctions[junction].at_hull) {
      // Beyond the last samples: use their height.
      if (!profile.empty()) return (end == 0 ? profile.front() : profile.back()).height;
      const auto height = nearest_height(near, plan_.junctions[junction].position);
      if (height) return *height;
    }
    return height_at(junction);
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
    // A sample on the line that is not a vertex would be off by a rounding error.
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
