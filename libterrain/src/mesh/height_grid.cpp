// SPDX-License-Identifier: Apache-2.0
#include "mesh/height_grid.hpp"

#include <algorithm>
#include <utility>

#include <terrace/base/filled.hpp>
#include <terrace/base/stop_check.hpp>

#include "base/progress_report.hpp"

namespace terrace::terrain {

namespace {

std::uint64_t reduced(std::uint64_t size, std::uint64_t reduction) {
  return (size + reduction - 1) / reduction;
}

std::uint64_t reduction_for(std::uint64_t columns, std::uint64_t rows, std::uint64_t max_cells) {
  std::uint64_t by = 1;
  while (reduced(columns, by) * reduced(rows, by) > max_cells && by < std::max(columns, rows)) {
    ++by;
  }
  return by;
}

}  // namespace

std::uint64_t HeightGrid::cells(std::uint64_t columns, std::uint64_t rows,
                                std::uint64_t max_cells) {
  const std::uint64_t by = reduction_for(columns, rows, max_cells);
  return reduced(columns, by) * reduced(rows, by);
}

HeightGrid::HeightGrid(std::uint64_t columns, std::uint64_t rows, std::uint64_t max_cells,
                       base::StopCheck check_stop)
    : check_stop_(std::move(check_stop)),
      reduction_(reduction_for(columns, rows, max_cells)),
      columns_(reduced(columns, reduction_)),
      rows_(reduced(rows, reduction_)),
      full_columns_(columns),
      full_rows_(rows) {
  sums_ = base::filled(columns_ * rows_, 0.0, check_stop_);
  counts_ = base::filled(columns_ * rows_, std::uint32_t{0}, check_stop_);
}

void HeightGrid::add(const stream::Point3& cell) {
  if (!(cell[0] >= 0 && cell[1] >= 0)) return;
  const auto column = static_cast<std::uint64_t>(cell[0]),
             row = static_cast<std::uint64_t>(cell[1]);
  if (column >= full_columns_ || row >= full_rows_) return;
  const std::size_t place = row / reduction_ * columns_ + column / reduction_;
  sums_[place] += cell[2];
  ++counts_[place];
}

TriangleMesh HeightGrid::mesh() const {
  constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  TriangleMesh mesh;
  std::vector<std::uint32_t> vertex = base::filled(sums_.size(), kNone, check_stop_);
  base::StopTicks ticks(check_stop_);
  const auto filled = sums_.size() - static_cast<std::size_t>(std::ranges::count(counts_, 0U));
  mesh.positions.reserve(filled);
  mesh.triangles.reserve(2 * filled);
  // An averaged square is placed at its centre.
  const double shift = 0.5 * static_cast<double>(reduction_ - 1);
  for (std::uint64_t row = 0; row < rows_; ++row) {
    ticks(4 * columns_);
    for (std::uint64_t column = 0; column < columns_; ++column) {
      const std::size_t place = row * columns_ + column;
      if (counts_[place] == 0) continue;
      vertex[place] = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.push_back({static_cast<double>(column * reduction_) + shift,
                                static_cast<double>(row * reduction_) + shift,
                                sums_[place] / static_cast<double>(counts_[place])});
    }
  }
  for (std::uint64_t row = 0; row + 1 < rows_; ++row) {
    ticks(16 * columns_);
    for (std::uint64_t column = 0; column + 1 < columns_; ++column) {
      const std::size_t place = row * columns_ + column;
      // Around the square; omitting any one corner leaves one triangle.
      const std::array<std::uint32_t, 4> around{
          vertex[place], vertex[place + 1], vertex[place + columns_ + 1], vertex[place + columns_]};
      const auto missing = std::count(around.begin(), around.end(), kNone);
      if (missing > 1) continue;
      if (missing == 0) {
        mesh.triangles.push_back({around[0], around[1], around[2]});
        mesh.triangles.push_back({around[0], around[2], around[3]});
      } else {
        std::array<std::uint32_t, 3> rest{};
        std::copy_if(around.begin(), around.end(), rest.begin(),
                     [](std::uint32_t v) { return v != kNone; });
        mesh.triangles.push_back(rest);
      }
    }
  }
  return mesh;
}

TriangleMesh reduced_raster(const stream::Store& store, std::uint64_t max_cells,
                            const Context& context) {
  HeightGrid grid(store.schema().columns, store.schema().rows, max_cells,
                  [&context] { context.check_stop(); });
  const ProgressReport progress(context, "points");
  std::uint64_t points = 0;
  for (const stream::LevelInfo& level : store.levels()) {
    store.for_each(level.level, [&](stream::ClusterId, const stream::ClusterRecord&,
                                    const stream::ClusterPoints& cluster) {
      context.check_stop();
      for (std::size_t i = 0; i < cluster.size(); ++i) {
        if (cluster.match(i)) grid.add(cluster.positions[i]);
      }
      points += cluster.size();
      progress.update(points, static_cast<double>(points) / static_cast<double>(store.points()));
    });
  }
  return grid.mesh();
}

}  // namespace terrace::terrain
