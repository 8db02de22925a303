// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/point_mesh_cuts.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace terrace::terrain {
namespace {

/// Cells are planned for this share of the most that they may have.
constexpr double kFullness = 0.88;
/// How far, in shares of the samples of one cell, a line may be from where it divides best.
constexpr double kSlack = 0.05;

class Cutter {
 public:
  Cutter(std::vector<Point2> some, std::uint64_t period, std::size_t most)
      : some_(std::move(some)),
        period_(static_cast<double>(period)),
        most_(static_cast<double>(most)) {}

  PointMeshCuts make() {
    Part whole;
    whole.end = some_.size();
    cuts_.root = divide(whole);
    return std::move(cuts_);
  }

 private:
  struct Part {
    std::size_t begin = 0, end = 0;  ///< of some_
    double cells = 0.0;              ///< to make of it; 0: not known
    PlaneBox box;
  };
  struct Line {
    unsigned axis = 0;
    double at = 0.0;
    bool balanced = false;
  };

  std::uint32_t divide(const Part& part);
  [[nodiscard]] std::optional<Line> line_for(const Part& part, double share, double slack) const;
  [[nodiscard]] std::optional<Line> line_along(const Part& part, unsigned axis, double share,
                                               double slack) const;
  [[nodiscard]] std::array<Point2, 2> bounds(const Part& part) const;
  std::uint32_t add_cell(const Part& part);

  std::vector<Point2> some_;
  double period_, most_;
  PointMeshCuts cuts_;
};

std::uint32_t Cutter::divide(const Part& part) {
  const double count = static_cast<double>(part.end - part.begin) * period_;
  if (count <= most_) return add_cell(part);
  const double cells =
      part.cells >= 2.0 ? part.cells : std::max(2.0, std::ceil(count / (kFullness * most_)));
  const double lower_cells = std::floor(cells / 2.0);
  const auto line = line_for(part, lower_cells / cells, kSlack / cells);
  if (!line) return add_cell(part);

  const unsigned axis = line->axis;
  const auto middle = std::partition(some_.begin() + static_cast<std::ptrdiff_t>(part.begin),
                                     some_.begin() + static_cast<std::ptrdiff_t>(part.end),
                                     [&](const Point2& p) { return p[axis] < line->at; });
  Part lower = part, upper = part;
  lower.end = upper.begin = static_cast<std::size_t>(middle - some_.begin());
  lower.box.max[axis] = upper.box.min[axis] = line->at;
  lower.cells = line->balanced ? lower_cells : 0.0;
  upper.cells = line->balanced ? cells - lower_cells : 0.0;
  const auto number = static_cast<std::uint32_t>(cuts_.nodes.size());
  const auto first = static_cast<std::uint32_t>(cuts_.cells.size());
  cuts_.nodes.push_back({axis, line->at, {}, first, 0});
  const std::uint32_t below = divide(lower), above = divide(upper);
  cuts_.nodes[number].next = {below, above};
  cuts_.nodes[number].cells = static_cast<std::uint32_t>(cuts_.cells.size()) - first;
  return number;
}

std::array<Point2, 2> Cutter::bounds(const Part& part) const {
  Point2 low = some_[part.begin], high = low;
  for (std::size_t i = part.begin; i < part.end; ++i) {
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], some_[i][k]);
      high[k] = std::max(high[k], some_[i][k]);
    }
  }
  return {low, high};
}

std::optional<Cutter::Line> Cutter::line_for(const Part& part, double share, double slack) const {
  const auto [low, high] = bounds(part);
  const unsigned longer = high[1] - low[1] > high[0] - low[0] ? 1 : 0;
  for (const double reach : {slack, 1.0}) {
    for (const unsigned axis : {longer, 1 - longer}) {
      if (const auto line = line_along(part, axis, share, reach)) return line;
    }
  }
  return std::nullopt;
}

std::optional<Cutter::Line> Cutter::line_along(const Part& part, unsigned axis, double share,
                                               double slack) const {
  std::vector<double> at;
  at.reserve(part.end - part.begin);
  for (std::size_t i = part.begin; i < part.end; ++i) at.push_back(some_[i][axis]);
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
  if (line == lower) {
    // No number fits between: the line runs through samples, but not through all above it.
    line = upper;
    const bool more = std::any_of(some_.begin() + static_cast<std::ptrdiff_t>(part.begin),
                                  some_.begin() + static_cast<std::ptrdiff_t>(part.end),
                                  [&](const Point2& p) { return p[axis] > line; });
    if (!more) return std::nullopt;
  }
  return Line{axis, line, !any};
}

std::uint32_t Cutter::add_cell(const Part& part) {
  PointMeshCuts::Cell cell;
  cell.box = part.box;
  cell.samples = static_cast<double>(part.end - part.begin) * period_;
  const auto [low, high] = bounds(part);
  cell.low = low;
  cell.high = high;
  const double width = high[0] - low[0], height = high[1] - low[1];
  cell.spacing =
      std::max(std::sqrt(width * height / cell.samples), std::max(width, height) / cell.samples);
  cuts_.cells.push_back(cell);
  return PointMeshCuts::kCell + static_cast<std::uint32_t>(cuts_.cells.size() - 1);
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

PointMeshCuts cut_for_point_mesh(std::vector<Point2> some, std::uint64_t period, std::size_t most) {
  return Cutter(std::move(some), period, most).make();
}

}  // namespace terrace::terrain
