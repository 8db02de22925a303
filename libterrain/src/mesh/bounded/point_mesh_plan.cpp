// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/point_mesh_plan.hpp"

#include <iterator>
#include <map>
#include <utility>

#include "base/streaming_hull.hpp"

namespace terrace::terrain {
namespace {

using Together = std::function<bool(std::uint32_t first, std::uint32_t cells)>;

class Planner {
 public:
  Planner(const PointMeshCuts& cuts, std::span<const Point2> hull, const Together& together)
      : tree_(cuts), hull_(hull), together_(together) {}

  PointMeshPlan make() {
    Part whole;
    whole.corners.assign(hull_.begin(), hull_.end());
    divide(tree_.root, std::move(whole));
    add_sides();
    return std::move(plan_);
  }

 private:
  struct Cut {
    unsigned axis = 0;
    double line = 0.0;
    std::map<double, std::uint32_t> knots;  ///< by their place along the line
  };
  /// The cuts at the lower and the upper border per axis.
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
  const Together& together_;
  std::vector<Cut> cuts_;
  std::vector<Borders> window_cuts_;
  PointMeshPlan plan_;
};

void Planner::divide(std::uint32_t at, Part part) {
  if (at >= PointMeshCuts::kCell) return add_window(at - PointMeshCuts::kCell, 1, std::move(part));
  const PointMeshCuts::Node& node = tree_.nodes[at];
  if (together_(node.first_cell, node.cells)) {
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
  Cut cut{.axis = axis, .line = line, .knots = {}};
  const unsigned along = 1 - axis;
  const auto ends = crossings(hull_, axis, line);
  for (const unsigned upper : {0U, 1U}) {
    const double border = upper != 0 ? part.box.max[along] : part.box.min[along];
    const std::uint32_t ancestor = part.cuts[along][upper];
    const double crossing = (*ends)[upper];
    const auto at = [&](double t) { return along == 0 ? Point2{t, line} : Point2{line, t}; };
    // Where rounding leaves the border no farther out than the crossing, they meet there.
    const bool meets =
        ancestor != kNoNumber && (upper != 0 ? border <= crossing : border >= crossing);
    const Point2 place = at(meets ? border : crossing);
    if (meets) {
      const auto [known, fresh] =
          cuts_[ancestor].knots.try_emplace(line, static_cast<std::uint32_t>(plan_.knots.size()));
      if (fresh) plan_.knots.push_back({place, false});
      cut.knots[border] = known->second;
    } else {
      cut.knots[crossing] = static_cast<std::uint32_t>(plan_.knots.size());
      plan_.knots.push_back({place, true});
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
  window.corners = std::move(part.corners);
  plan_.windows.push_back(std::move(window));
  window_cuts_.push_back(part.cuts);
}

void Planner::add_sides() {
  std::map<std::array<std::uint32_t, 2>, std::uint32_t> by_knots;
  for (std::uint32_t w = 0; w < plan_.windows.size(); ++w) {
    PointMeshPlan::Window& window = plan_.windows[w];
    for (const unsigned axis : {0U, 1U}) {
      for (const unsigned upper : {0U, 1U}) {
        const std::uint32_t number = window_cuts_[w][axis][upper];
        if (number == kNoNumber) continue;
        const Cut& cut = cuts_[number];
        auto knot = cut.knots.lower_bound(window.box.min[1 - axis]);
        for (; knot != cut.knots.end(); ++knot) {
          const auto next = std::next(knot);
          if (next == cut.knots.end() || next->first > window.box.max[1 - axis]) break;
          const std::array<std::uint32_t, 2> ends{knot->second, next->second};
          const auto [known, fresh] =
              by_knots.try_emplace(ends, static_cast<std::uint32_t>(plan_.sides.size()));
          if (fresh) {
            plan_.sides.push_back(
                {.axis = axis, .line = cut.line, .knots = ends, .windows = {kNoNumber, kNoNumber}});
          }
          plan_.sides[known->second].windows[1 - upper] = w;
          window.sides.push_back(known->second);
        }
      }
    }
  }
  // A knot of several sides has its height from neither.
  std::vector<unsigned> ends(plan_.knots.size(), 0);
  for (const PointMeshPlan::Side& side : plan_.sides) {
    for (const std::uint32_t knot : side.knots) {
      if (++ends[knot] > 1) plan_.knots[knot].at_hull = false;
    }
  }
}

}  // namespace

PointMeshPlan plan_point_mesh(const PointMeshCuts& cuts, std::span<const Point2> hull,
                              const Together& together) {
  return Planner(cuts, hull, together).make();
}

}  // namespace terrace::terrain
