// SPDX-License-Identifier: Apache-2.0
#include "surface/point_fill.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>

#include "terrace/terrain/detail.hpp"

namespace terrace::terrain {
namespace {

constexpr std::uint64_t kMostFillPoints = std::uint64_t{1} << 23;
constexpr std::uint64_t kMostFillCells = std::uint64_t{1} << 20;

}  // namespace

PointFill::PointFill(const stream::Store& store) {
  Detail detail;
  while (detail.level < store.top() && store.levels()[detail.level].points > kMostFillPoints) {
    ++detail.level;
  }
  // About a point to a cell, so that the surface fits to those at the border.
  const std::uint64_t points = store.levels()[detail.level].points;
  const auto cells = static_cast<double>(std::clamp<std::uint64_t>(points, 1, kMostFillCells));
  const stream::Box3& box = store.bounds();
  const double width = box.max[0] - box.min[0], height = box.max[1] - box.min[1];
  std::array<std::size_t, 2> size{1, 1};
  if (width > 0.0) {
    const double columns = height > 0.0 ? std::sqrt(cells) * std::sqrt(width / height) : cells;
    size[0] = static_cast<std::size_t>(std::clamp(std::ceil(columns), 1.0, cells));
  }
  if (height > 0.0) size[1] = static_cast<std::size_t>(cells) / size[0];
  for (std::size_t axis = 0; axis < 2; ++axis) {
    size[axis] = std::max<std::size_t>(size[axis], 1);
    from_[axis] = box.min[axis];
    const double length = box.max[axis] - box.min[axis];
    cells_per_unit_[axis] = length > 0.0 ? static_cast<double>(size[axis]) / length : 0.0;
  }

  std::vector<double> sum(size[0] * size[1]), weight(size[0] * size[1]);
  for_each_wanted(
      store, detail,
      [&](stream::ClusterId, const stream::ClusterRecord&, const stream::ClusterPoints& cluster) {
        for (const stream::Point3& p : cluster.positions) {
          if (!std::isfinite(p[2])) continue;
          std::array<std::size_t, 2> at;
          for (std::size_t axis = 0; axis < 2; ++axis) {
            const double place = (p[axis] - from_[axis]) * cells_per_unit_[axis];
            at[axis] = std::min(static_cast<std::size_t>(place), size[axis] - 1);
          }
          sum[at[1] * size[0] + at[0]] += p[2];
          weight[at[1] * size[0] + at[0]] += 1.0;
        }
      });
  if (std::all_of(weight.begin(), weight.end(), [](double w) { return w == 0.0; })) {
    throw stream::Error({.file = store.path().string(),
                         .where = {},
                         .cause = "no point has a height, so there is nothing to tile",
                         .remedy = "look at the source's third coordinate"});
  }
  grid_.emplace(size[0], size[1], std::move(sum), std::move(weight));
}

double PointFill::height(double x, double y) const {
  return grid_->height((x - from_[0]) * cells_per_unit_[0], (y - from_[1]) * cells_per_unit_[1]);
}

}  // namespace terrace::terrain
