// SPDX-License-Identifier: Apache-2.0
#include "surface/point_cells.hpp"

#include <cmath>
#include <numeric>

namespace terrace::terrain {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr double kPointsPerCell = 2;
/// Points crowd if those that share a cell with one of them are so many on average.
constexpr double kCrowd = 48;
/// So many are sorted without more memory.
constexpr std::size_t kFewInCells = 16;

}  // namespace

void PointCells::clear() {
  known_ = {{kFar, kFar}, {-kFar, -kFar}};
  columns_ = rows_ = 1;
  per_unit_ = {};
  places_.clear();
  heights_.clear();
  begin_.assign(2, 0);
}

bool PointCells::load(stream::StoreQuery& query, unsigned level, const StoredBox& box,
                      std::size_t most_points, bool may_crowd) {
  clear();
  const stream::Store& store = query.store();
  const stream::Channel& channel = store.schema().coordinates[2];
  std::vector<Point2> places;
  std::vector<double> heights;
  bool too_many = false;
  query.descend(
      level,
      [&](unsigned, const stream::StoreQuery::Branch& branch) {
        return !too_many && box.meets(branch.box);
      },
      [&](const stream::StoreQuery::Node& node) {
        for (const stream::Point3& p : node.positions) {
          if (!box.contains(p)) continue;
          places.push_back({p[0], p[1]});
          heights.push_back(p[2] * channel.scale + channel.offset);
        }
        too_many = places.size() > most_points;
      });
  if (too_many) return false;

  for (std::size_t k = 0; k < 2; ++k) {
    box_.min[k] = std::max(box.min[k], store.bounds().min[k]);
    box_.max[k] = std::min(box.max[k], store.bounds().max[k]);
  }
  const double width = box_.max[0] - box_.min[0], height = box_.max[1] - box_.min[1];
  const double cells = std::max(1.0, static_cast<double>(places.size()) / kPointsPerCell);
  // As many columns as make the cells square.
  if (width > 0) {
    const double columns = height > 0 ? std::sqrt(cells) * std::sqrt(width / height) : cells;
    columns_ = static_cast<std::uint32_t>(std::clamp(columns, 1.0, cells));
  }
  if (height > 0) rows_ = std::max(static_cast<std::uint32_t>(cells) / columns_, 1U);
  for (std::size_t k = 0; k < 2; ++k) {
    const double size = box_.max[k] - box_.min[k], count = k == 0 ? columns_ : rows_;
    per_unit_[k] = size > 0 ? count / size : 0.0;
    // So small a box that its cells are not to be told apart has one.
    if (!(per_unit_[k] < kFar)) per_unit_[k] = 0.0;
    cell_size_[k] = size / count;
  }

  begin_.assign(std::size_t{columns_} * rows_ + 1, 0);
  for (const Point2& p : places) ++begin_[cell(p) + 1];
  double shared = 0;
  for (const std::uint32_t count : begin_) shared += static_cast<double>(count) * count;
  if (!may_crowd && shared > kCrowd * static_cast<double>(places.size())) {
    clear();
    return false;
  }
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  places_.resize(places.size());
  heights_.resize(places.size());
  // begin_[c] goes from the cell's begin to its end, which is where the next one begins.
  for (std::size_t i = 0; i < places.size(); ++i) {
    const std::uint32_t at = begin_[cell(places[i])]++;
    places_[at] = places[i];
    heights_[at] = heights[i];
  }
  std::copy_backward(begin_.begin(), begin_.end() - 2, begin_.end() - 1);
  begin_.front() = 0;
  drop_duplicates();

  for (std::size_t k = 0; k < 2; ++k) {
    known_.min[k] = box.min[k] <= store.bounds().min[k] ? -kFar : box.min[k];
    known_.max[k] = box.max[k] >= store.bounds().max[k] ? kFar : box.max[k];
  }
  return true;
}

void PointCells::drop_duplicates() {
  std::vector<std::pair<Point2, double>> sorted;
  std::uint32_t kept = 0, first = 0;
  for (std::size_t c = 0; c + 1 < begin_.size(); ++c) {
    const std::uint32_t end = begin_[c + 1];
    begin_[c] = kept;
    if (end - first > 1) {
      sorted.clear();
      for (std::uint32_t i = first; i < end; ++i) sorted.emplace_back(places_[i], heights_[i]);
      // Stable: of equal ones the first stays so.
      const auto less = [](const auto& a, const auto& b) { return a.first < b.first; };
      if (sorted.size() > kFewInCells) {
        std::stable_sort(sorted.begin(), sorted.end(), less);
      } else {
        for (auto at = sorted.begin() + 1; at != sorted.end(); ++at) {
          std::rotate(std::upper_bound(sorted.begin(), at, *at, less), at, at + 1);
        }
      }
      for (std::size_t i = 0; i < sorted.size(); ++i) {
        if (i > 0 && sorted[i].first == sorted[i - 1].first) continue;
        places_[kept] = sorted[i].first;
        heights_[kept++] = sorted[i].second;
      }
    } else if (end > first) {
      places_[kept] = places_[first];
      heights_[kept++] = heights_[first];
    }
    first = end;
  }
  begin_.back() = kept;
  places_.resize(kept);
  heights_.resize(kept);
}

StoredBox PointCells::box_of(const Range& range) const {
  const std::array<double, 2> from{static_cast<double>(range.column),
                                   static_cast<double>(range.row)};
  const std::array<double, 2> to{static_cast<double>(range.end_column),
                                 static_cast<double>(range.end_row)};
  StoredBox box;
  for (std::size_t k = 0; k < 2; ++k) {
    // A cell more to each side, for rounding.
    const double slack = cell_size_[k] + 4 * std::numeric_limits<double>::epsilon() *
                                             (std::abs(box_.min[k]) + std::abs(box_.max[k]));
    box.min[k] = box_.min[k] + from[k] * cell_size_[k] - slack;
    box.max[k] = box_.min[k] + to[k] * cell_size_[k] + slack;
  }
  return box;
}

double PointCells::height(const Point2& point) const {
  const std::size_t c = cell(point);
  const auto from = places_.begin() + begin_[c], to = places_.begin() + begin_[c + 1];
  const auto found = std::find(from, to, point);
  return found == to ? std::numeric_limits<double>::quiet_NaN()
                     : heights_[static_cast<std::size_t>(found - places_.begin())];
}

}  // namespace terrace::terrain
