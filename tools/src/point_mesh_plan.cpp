// SPDX-License-Identifier: GPL-3.0-or-later
#include "point_mesh_plan.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

#include "streaming_hull.hpp"

namespace terrace::tools {
namespace {

/// Windows are planned for this share of the most that they may have.
constexpr double kFullness = 0.88;
/// How far, in shares of the samples of one window, a line may be from where it divides best.
constexpr double kSlack = 0.05;

class Planner {
 public:
  Planner(std::vector<Point2> some, std::uint64_t period, std::span<const Point2> hull,
          std::size_t most)
      : some_(std::move(some)),
        period_(static_cast<double>(period)),
        hull_(hull),
        most_(static_cast<double>(most)) {}

  PointMeshPlan make() {
    Node root;
    root.end = some_.size();
    root.corners.assign(hull_.begin(), hull_.end());
    plan_.root = divide(std::move(root));
    add_sides();
    return std::move(plan_);
  }

 private:
  struct Cut {
    unsigned axis = 0;
    double line = 0.0;
    std::map<double, std::uint32_t> knots;  ///< by their place along the line
  };
  struct Node {
    std::size_t begin = 0, end = 0;  ///< of some_
    double parts = 0.0;              ///< windows to make of it; 0: not known
    PlaneBox box;
    /// The cuts at the lower and the upper border per axis.
    std::array<std::array<std::uint32_t, 2>, 2> cuts{
        {{kNoNumber, kNoNumber}, {kNoNumber, kNoNumber}}};
    std::vector<Point2> corners;
  };
  struct Line {
    unsigned axis = 0;
    double at = 0.0;
    bool balanced = false;
  };

  std::uint32_t divide(Node node);
  std::optional<Line> line_for(const Node& node, double share, double slack);
  std::optional<Line> line_along(const Node& node, unsigned axis, double share, double slack);
  std::uint32_t add_cut(const Node& node, const Line& line);
  std::uint32_t add_window(Node node);
  void add_sides();

  std::vector<Point2> some_;
  double period_;
  std::span<const Point2> hull_;
  double most_;
  std::vector<Cut> cuts_;
  std::vector<std::array<std::array<std::uint32_t, 2>, 2>> window_cuts_;
  PointMeshPlan plan_;
};

std::uint32_t Planner::divide(Node node) {
  const double count = static_cast<double>(node.end - node.begin) * period_;
  if (count <= most_) return add_window(std::move(node));
  if (node.parts < 2.0) node.parts = std::max(2.0, std::ceil(count / (kFullness * most_)));
  const double lower_parts = std::floor(node.parts / 2.0);
  const auto line = line_for(node, lower_parts / node.parts, kSlack / node.parts);
  if (!line) return add_window(std::move(node));

  const std::uint32_t cut = add_cut(node, *line);
  const unsigned axis = line->axis;
  const auto below = [&](const Point2& p) { return p[axis] < line->at; };
  const auto middle = std::partition(some_.begin() + static_cast<std::ptrdiff_t>(node.begin),
                                     some_.begin() + static_cast<std::ptrdiff_t>(node.end), below);
  Node lower = node, upper = std::move(node);
  lower.end = upper.begin = static_cast<std::size_t>(middle - some_.begin());
  lower.box.max[axis] = upper.box.min[axis] = line->at;
  lower.cuts[axis][1] = upper.cuts[axis][0] = cut;
  lower.parts = line->balanced ? lower_parts : 0.0;
  upper.parts = line->balanced ? upper.parts - lower_parts : 0.0;
  std::erase_if(lower.corners, [&](const Point2& p) { return !below(p); });
  std::erase_if(upper.corners, below);
  const auto number = static_cast<std::uint32_t>(plan_.nodes.size());
  plan_.nodes.push_back({axis, line->at, {}});
  const std::uint32_t first = divide(std::move(lower));
  const std::uint32_t second = divide(std::move(upper));
  plan_.nodes[number].next = {first, second};
  return number;
}

std::optional<Planner::Line> Planner::line_for(const Node& node, double share, double slack) {
  Point2 low = some_[node.begin], high = low;
  for (std::size_t i = node.begin; i < node.end; ++i) {
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], some_[i][k]);
      high[k] = std::max(high[k], some_[i][k]);
    }
  }
  const unsigned longer = high[1] - low[1] > high[0] - low[0] ? 1 : 0;
  for (const double reach : {slack, 1.0}) {
    for (const unsigned axis : {longer, 1 - longer}) {
      if (const auto line = line_along(node, axis, share, reach)) return line;
    }
  }
  return std::nullopt;
}

std::optional<Planner::Line> Planner::line_along(const Node& node, unsigned axis, double share,
                                                 double slack) {
  std::vector<double> at;
  at.reserve(node.end - node.begin);
  for (std::size_t i = node.begin; i < node.end; ++i) at.push_back(some_[i][axis]);
  const auto last = static_cast<double>(at.size() - 1);
  const auto first_rank = static_cast<std::size_t>(std::max(0.0, (share - slack) * last));
  const auto last_rank = static_cast<std::size_t>(std::min(last, (share + slack) * last + 1.0));
  const auto place = [&](std::size_t rank) {
    return at.begin() + static_cast<std::ptrdiff_t>(rank);
  };
  std::nth_element(at.begin(), place(first_rank), at.end());
  if (last_rank > first_rank) {
    std::nth_element(place(first_rank) + 1, place(last_rank), at.end());
  }
  std::sort(place(first_rank), place(last_rank) + 1);
  // The widest gap; of a lattice's, which are all alike, the nearest. With all ranks allowed the
  // nearest, however narrow.
  const bool any = slack >= 1.0;
  const double wanted = share * last;
  double best = 0.0, lower = 0.0, upper = 0.0;
  for (std::size_t rank = first_rank; rank < last_rank; ++rank) {
    const double gap = at[rank + 1] - at[rank];
    if (!(gap > 0.0)) continue;
    const double away = std::abs(static_cast<double>(rank) + 0.5 - wanted) / (last + 1.0);
    const double worth = any ? 1.0 / (1.0 + away * last) : gap * (1.0 - away);
    if (worth > best) {
      best = worth;
      lower = at[rank];
      upper = at[rank + 1];
    }
  }
  if (!(best > 0.0)) return std::nullopt;
  double line = number_between(lower, upper);
  // Where no number fits between, the line runs through samples: they belong above.
  if (line == lower) {
    line = upper;
    const bool more = std::any_of(some_.begin() + static_cast<std::ptrdiff_t>(node.begin),
                                  some_.begin() + static_cast<std::ptrdiff_t>(node.end),
                                  [&](const Point2& p) { return p[axis] > line; });
    if (!more) return std::nullopt;
  }
  return Line{axis, line, !any};
}

std::uint32_t Planner::add_cut(const Node& node, const Line& line) {
  const auto number = static_cast<std::uint32_t>(cuts_.size());
  Cut cut{.axis = line.axis, .line = line.at, .knots = {}};
  const unsigned along = 1 - line.axis;
  const auto ends = crossings(hull_, line.axis, line.at);
  for (const unsigned upper : {0U, 1U}) {
    const double border = upper != 0 ? node.box.max[along] : node.box.min[along];
    const std::uint32_t ancestor = node.cuts[along][upper];
    const double crossing = (*ends)[upper];
    const auto at = [&](double t) { return along == 0 ? Point2{t, line.at} : Point2{line.at, t}; };
    // Where rounding leaves the border no farther out than the crossing, they meet there.
    const bool meets =
        ancestor != kNoNumber && (upper != 0 ? border <= crossing : border >= crossing);
    const Point2 place = at(meets ? border : crossing);
    if (meets) {
      const auto [known, fresh] = cuts_[ancestor].knots.try_emplace(
          line.at, static_cast<std::uint32_t>(plan_.knots.size()));
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

std::uint32_t Planner::add_window(Node node) {
  PointMeshPlan::Window window;
  window.box = node.box;
  const auto count = static_cast<double>(node.end - node.begin);
  window.samples = count * period_;
  Point2 low = some_[node.begin], high = low;
  for (std::size_t i = node.begin; i < node.end; ++i) {
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], some_[i][k]);
      high[k] = std::max(high[k], some_[i][k]);
    }
  }
  const double width = high[0] - low[0], height = high[1] - low[1];
  window.spacing = std::max(std::sqrt(width * height / window.samples),
                            std::max(width, height) / window.samples);
  window.corners = std::move(node.corners);
  plan_.windows.push_back(std::move(window));
  window_cuts_.push_back(node.cuts);
  return PointMeshPlan::kLeaf + static_cast<std::uint32_t>(plan_.windows.size() - 1);
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

double number_between(double a, double b) {
  const double quarter = b / 4.0 - a / 4.0;
  const double low = a + quarter, high = b - quarter;
  if (!(a < low && low < high && high < b)) {
    const double middle = a / 2.0 + b / 2.0;
    return a < middle && middle < b ? middle : a;
  }
  if (low < 0.0 && high > 0.0) return 0.0;
  for (double step = std::ldexp(1.0, std::ilogb(high - low) + 1);; step /= 2.0) {
    const double number = std::floor(high / step) * step;
    if (number > low && number <= high) return number;
  }
}

PointMeshPlan plan_point_mesh(std::vector<Point2> some, std::uint64_t period,
                              std::span<const Point2> hull, std::size_t most) {
  return Planner(std::move(some), period, hull, most).make();
}

}  // namespace terrace::tools
