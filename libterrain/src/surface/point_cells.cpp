// SPDX-License-Identifier: Apache-2.0
#include "surface/point_cells.hpp"

#include <cmath>
#include <numeric>
#include <string>

#include <terrace/stream/error.hpp>

#include "base/parallel.hpp"
#include "base/store_checks.hpp"

namespace terrace::terrain {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr double kPointsPerCell = 2;
/// Points are crowded if a point shares its cell with this many on average.
constexpr double kCrowdedNeighbours = 48;
/// Up to this many points of a cell are sorted without extra memory.
constexpr std::size_t kFewInCells = 16;
/// Clusters that a thread decodes at a time.
constexpr std::uint64_t kClustersAtOnce = 256;
/// Points sorted between two checks for a stop.
constexpr std::size_t kPointsPerCheck = std::size_t{1} << 20;

}  // namespace

void PointCells::clear() {
  loaded_box_ = {{kFar, kFar}, {-kFar, -kFar}};
  columns_ = rows_ = 1;
  cells_per_unit_ = {};
  positions_.reset();
  heights_.reset();
  cell_begin_.assign(2, 0);
  prefix_sums_.assign(4, 0);
}

bool PointCells::load(stream::StoreQuery& query, const WantedClusters& wanted, const StoredBox& box,
                      std::size_t max_points, bool allow_crowding) {
  clear();
  const stream::Store& store = query.store();
  const stream::Channel& channel = store.schema().coordinates[2];
  std::vector<Point2> positions;
  std::vector<double> heights;
  bool too_many = false;
  query.descend(
      wanted.finest(),
      [&](unsigned at, const stream::StoreQuery::Branch& branch) {
        return !too_many && box.intersects(flat(branch.box)) && wanted(at, branch.box);
      },
      [&](const stream::StoreQuery::Node& node) {
        for (const stream::Point3& p : node.positions) {
          if (!box.contains(flat(p))) continue;
          positions.push_back({p[0], p[1]});
          heights.push_back(p[2] * channel.scale + channel.offset);
        }
        too_many = positions.size() > max_points;
      });
  return !too_many && (sort(store, box, positions, heights, allow_crowding, 1) || allow_crowding);
}

bool PointCells::load_all(const stream::Store& store, unsigned level, unsigned threads) {
  clear();
  const stream::Channel& channel = store.schema().coordinates[2];
  /// Clusters with points stored consecutively from `begin` on.
  struct Piece {
    unsigned level = 0;
    std::uint64_t first = 0, end = 0;  ///< ordinals
    std::size_t begin = 0, points = 0;
  };
  std::vector<Piece> pieces;
  for (unsigned at = store.top() + 1; at-- > level;) {
    const std::uint64_t clusters = store.levels()[at].clusters;
    for (std::uint64_t first = 0; first < clusters; first += kClustersAtOnce) {
      pieces.push_back({at, first, std::min(first + kClustersAtOnce, clusters)});
    }
  }
  parallel_for(pieces.size(), threads, [&](std::size_t i) {
    Piece& piece = pieces[i];
    for (std::uint64_t k = piece.first; k < piece.end; ++k) {
      piece.points += store.record(stream::cluster_id(piece.level, k)).points;
    }
  });
  std::size_t count = 0;
  for (Piece& piece : pieces) {
    piece.begin = count;
    count += piece.points;
  }
  need_all_points(store, level, count);
  const auto positions = large_array<Point2>(count);
  const auto heights = large_array<double>(count);
  parallel_for(pieces.size(), threads, [&](std::size_t i) {
    Piece& piece = pieces[i];
    std::size_t at = piece.begin;
    stream::ClusterPoints cluster;
    for (std::uint64_t k = piece.first; k < piece.end; ++k) {
      const stream::ClusterId id = stream::cluster_id(piece.level, k);
      if (!store.may_match(id)) continue;
      store.read(id, cluster);
      for (std::size_t m = 0; m < cluster.size(); ++m) {
        if (!cluster.match(m)) continue;
        const stream::Point3& p = cluster.positions[m];
        positions[at] = {p[0], p[1]};
        heights[at++] = p[2] * channel.scale + channel.offset;
      }
    }
    piece.points = at - piece.begin;
  });
  // Close the gaps left by points that do not match a view's condition.
  count = 0;
  for (const Piece& piece : pieces) {
    if (count < piece.begin) {
      std::copy_n(positions.get() + piece.begin, piece.points, positions.get() + count);
      std::copy_n(heights.get() + piece.begin, piece.points, heights.get() + count);
    }
    count += piece.points;
  }
  return sort(store, flat(store.bounds()), {positions.get(), count}, {heights.get(), count}, true,
              threads);
}

bool PointCells::sort(const stream::Store& store, const StoredBox& box,
                      std::span<const Point2> positions, std::span<const double> heights,
                      bool allow_crowding, unsigned threads) {
  for (std::size_t k = 0; k < 2; ++k) {
    box_.min[k] = std::max(box.min[k], store.bounds().min[k]);
    box_.max[k] = std::min(box.max[k], store.bounds().max[k]);
  }
  const double width = box_.max[0] - box_.min[0], height = box_.max[1] - box_.min[1];
  const double cells = std::max(1.0, static_cast<double>(positions.size()) / kPointsPerCell);
  // Choose the number of columns that makes the cells square.
  if (width > 0) {
    const double columns = height > 0 ? std::sqrt(cells) * std::sqrt(width / height) : cells;
    columns_ = static_cast<std::uint32_t>(std::clamp(columns, 1.0, cells));
  }
  if (height > 0) rows_ = std::max(static_cast<std::uint32_t>(cells) / columns_, 1U);
  for (std::size_t k = 0; k < 2; ++k) {
    const double size = box_.max[k] - box_.min[k], count = k == 0 ? columns_ : rows_;
    cells_per_unit_[k] = size > 0 ? count / size : 0.0;
    // A box too small to distinguish its cells gets one cell.
    if (!(cells_per_unit_[k] < kFar)) cells_per_unit_[k] = 0.0;
    cell_size_[k] = size / count;
  }

  cell_begin_.assign(std::size_t{columns_} * rows_ + 1, 0);
  // Each thread scans all positions and handles those in its band, in order.
  const auto in_bands = [&](const auto& handle) {
    const std::uint32_t bands = std::clamp(threads, 1U, rows_);
    parallel_for(bands, threads, [&](std::size_t band) {
      const auto from = static_cast<std::uint32_t>(std::uint64_t{rows_} * band / bands);
      const auto to = static_cast<std::uint32_t>(std::uint64_t{rows_} * (band + 1) / bands);
      for (std::size_t i = 0; i < positions.size(); ++i) {
        if (i % kPointsPerCheck == 0) store.check_stop();
        const std::uint32_t row = index(1, positions[i][1], rows_);
        if (row >= from && row < to) handle(cell(positions[i]), i);
      }
    });
  };
  in_bands([&](std::size_t at, std::size_t) { ++cell_begin_[at + 1]; });
  double shared = 0;
  for (const std::uint32_t count : cell_begin_) shared += static_cast<double>(count) * count;
  const bool is_crowded = shared > kCrowdedNeighbours * static_cast<double>(positions.size());
  if (is_crowded && !allow_crowding) {
    clear();
    return false;
  }
  std::partial_sum(cell_begin_.begin(), cell_begin_.end(), cell_begin_.begin());
  positions_ = large_array<Point2>(positions.size());
  heights_ = large_array<double>(positions.size());
  // Advances cell_begin_[c] from the cell's begin to its end, which is where the next one begins.
  in_bands([&](std::size_t at, std::size_t i) {
    positions_[cell_begin_[at]] = positions[i];
    heights_[cell_begin_[at]++] = heights[i];
  });
  std::copy_backward(cell_begin_.begin(), cell_begin_.end() - 2, cell_begin_.end() - 1);
  cell_begin_.front() = 0;
  drop_duplicates();
  const std::size_t side = std::size_t{columns_} + 1;
  prefix_sums_.assign(side * (std::size_t{rows_} + 1), 0);
  for (std::size_t row = 0; row < rows_; ++row) {
    const std::size_t first = row * columns_;
    for (std::size_t column = 1; column < side; ++column) {
      prefix_sums_[(row + 1) * side + column] =
          prefix_sums_[row * side + column] + cell_begin_[first + column] - cell_begin_[first];
    }
  }

  for (std::size_t k = 0; k < 2; ++k) {
    loaded_box_.min[k] = box.min[k] <= store.bounds().min[k] ? -kFar : box.min[k];
    loaded_box_.max[k] = box.max[k] >= store.bounds().max[k] ? kFar : box.max[k];
  }
  return !is_crowded;
}

void PointCells::drop_duplicates() {
  std::vector<std::pair<Point2, double>> sorted;
  std::uint32_t kept = 0, first = 0;
  for (std::size_t c = 0; c + 1 < cell_begin_.size(); ++c) {
    const std::uint32_t end = cell_begin_[c + 1];
    cell_begin_[c] = kept;
    if (end - first > 1) {
      sorted.clear();
      for (std::uint32_t i = first; i < end; ++i) sorted.emplace_back(positions_[i], heights_[i]);
      // A stable sort keeps the first of equal points first.
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
        positions_[kept] = sorted[i].first;
        heights_[kept++] = sorted[i].second;
      }
    } else if (end > first) {
      positions_[kept] = positions_[first];
      heights_[kept++] = heights_[first];
    }
    first = end;
  }
  cell_begin_.back() = kept;
}

StoredBox PointCells::box_of(const Range& range) const {
  const std::array<double, 2> from{static_cast<double>(range.column),
                                   static_cast<double>(range.row)};
  const std::array<double, 2> to{static_cast<double>(range.end_column),
                                 static_cast<double>(range.end_row)};
  StoredBox box;
  for (std::size_t k = 0; k < 2; ++k) {
    // Add a cell on each side, for rounding.
    const double slack = cell_size_[k] + 4 * std::numeric_limits<double>::epsilon() *
                                             (std::abs(box_.min[k]) + std::abs(box_.max[k]));
    box.min[k] = box_.min[k] + from[k] * cell_size_[k] - slack;
    box.max[k] = box_.min[k] + to[k] * cell_size_[k] + slack;
  }
  return box;
}

double PointCells::height(const Point2& point) const {
  const std::size_t c = cell(point);
  for (std::uint32_t i = cell_begin_[c]; i < cell_begin_[c + 1]; ++i) {
    if (positions_[i] == point) return heights_[i];
  }
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace terrace::terrain
