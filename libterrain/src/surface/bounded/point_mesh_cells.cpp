// SPDX-License-Identifier: Apache-2.0
#include "surface/bounded/point_mesh_cells.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

namespace terrace::terrain {
namespace {

/// Target for the fullness of cells.
constexpr double kFullness = 0.88;
/// Tolerance for the position of a line, as a share of the samples of one cell.
constexpr double kSlack = 0.05;

class Cutter {
 public:
  Cutter(std::vector<Point2> sample, std::uint64_t period, std::size_t max_per_cell)
      : sample_(std::move(sample)),
        period_(static_cast<double>(period)),
        max_per_cell_(static_cast<double>(max_per_cell)) {}

  PointMeshCuts make() {
    Part all_points;
    all_points.end = sample_.size();
    cuts_.root = divide(all_points);
    return std::move(cuts_);
  }

 private:
  struct Part {
    std::size_t begin = 0, end = 0;  ///< range in sample_
    double cells = 0.0;              ///< number of cells to divide it into; 0: unknown
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

  std::vector<Point2> sample_;
  double period_, max_per_cell_;
  PointMeshCuts cuts_;
};

std::uint32_t Cutter::divide(const Part& part) {
  const double count = static_cast<double>(part.end - part.begin) * period_;
  if (count <= max_per_cell_) return add_cell(part);
  const double cells = part.cells >= 2.0
                           ? part.cells
                           : std::max(2.0, std::ceil(count / (kFullness * max_per_cell_)));
  const double lower_cells = std::floor(cells / 2.0);
  const auto line = line_for(part, lower_cells / cells, kSlack / cells);
  if (!line) return add_cell(part);

  const unsigned axis = line->axis;
  const auto middle = std::partition(sample_.begin() + static_cast<std::ptrdiff_t>(part.begin),
                                     sample_.begin() + static_cast<std::ptrdiff_t>(part.end),
                                     [&](const Point2& p) { return p[axis] < line->at; });
  Part lower = part, upper = part;
  lower.end = upper.begin = static_cast<std::size_t>(middle - sample_.begin());
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
  Point2 low = sample_[part.begin], high = low;
  for (std::size_t i = part.begin; i < part.end; ++i) {
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], sample_[i][k]);
      high[k] = std::max(high[k], sample_[i][k]);
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
  for (std::size_t i = part.begin; i < part.end; ++i) at.push_back(sample_[i][axis]);
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
  // Prefer the widest gap; in a lattice, where all are equal, the nearest. If all ranks are
  // allowed, take the nearest, however narrow.
  const bool any = slack >= 1.0;
  const double target_rank = share * last;
  double best = 0.0, lower = 0.0, upper = 0.0;
  for (std::size_t rank = first_rank; rank < last_rank; ++rank) {
    const double gap = at[rank + 1] - at[rank];
    if (!(gap > 0.0)) continue;
    const double distance = std::abs(static_cast<double>(rank) + 0.5 - target_rank) / (last + 1.0);
    const double worth = any ? 1.0 / (1.0 + distance * last) : gap * (1.0 - distance);
    if (worth > best) {
      best = worth;
      lower = at[rank];
      upper = at[rank + 1];
    }
  }
  if (!(best > 0.0)) return std::nullopt;
  double line = number_between(lower, upper);
  if (line == lower) {
    // There is no number between, so the line passes through samples; some must be above it.
    line = upper;
    const bool more = std::any_of(sample_.begin() + static_cast<std::ptrdiff_t>(part.begin),
                                  sample_.begin() + static_cast<std::ptrdiff_t>(part.end),
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

PointMeshCuts cut_for_point_mesh(std::vector<Point2> sample, std::uint64_t period,
                                 std::size_t max_per_cell) {
  return Cutter(std::move(sample), period, max_per_cell).make();
}

double merged_height(std::span<const double> heights, tri::PointDuplicates duplicates) {
  double height = heights.front();
  if (duplicates == tri::PointDuplicates::min) {
    height = *std::min_element(heights.begin(), heights.end());
  } else if (duplicates == tri::PointDuplicates::max) {
    height = *std::max_element(heights.begin(), heights.end());
  } else if (duplicates == tri::PointDuplicates::mean) {
    double sum = 0.0;
    for (const double other : heights) sum += other - heights.front();
    height += sum / static_cast<double>(heights.size());
  } else if (duplicates == tri::PointDuplicates::all) {
    const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
    height = *low + (*high - *low) / 2.0;
  }
  return height;
}

void SharedPlaces::add(const MeshSamples& samples) {
  std::vector<std::uint32_t> order(samples.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto place = [&](std::uint32_t i) { return Point2{samples.x[i], samples.y[i]}; };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return place(a) < place(b); });
  for (std::size_t first = 0, end = 0; first < order.size(); first = end) {
    double low = samples.z[order[first]], high = low;
    for (end = first + 1; end < order.size() && place(order[end]) == place(order[first]); ++end) {
      low = std::min(low, samples.z[order[end]]);
      high = std::max(high, samples.z[order[end]]);
    }
    if (end - first == 1) continue;
    if (places == 0 || high - low > range) {
      range = high - low;
      widest = place(order[first]);
    }
    ++places;
  }
}

}  // namespace terrace::terrain
