// SPDX-License-Identifier: Apache-2.0
#include "surface/raster_fill.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>

#include "base/digest.hpp"
#include "terrace/terrain/detail.hpp"

namespace terrace::terrain {
namespace {

constexpr std::size_t kMostFilledCells = std::size_t{1} << 20;

}  // namespace

RasterFill::RasterFill(const stream::Store& store) {
  const stream::StoreSchema& schema = store.schema();
  std::size_t reduction = 1;
  const auto reduced = [&](std::uint64_t count) {
    return (static_cast<std::size_t>(count) + reduction - 1) / reduction;
  };
  while (reduced(schema.columns) * reduced(schema.rows) > kMostFilledCells) ++reduction;
  reduction_ = static_cast<double>(reduction);

  // The points of level 1 lie close enough for a surface that nothing measures.
  const std::size_t columns = reduced(schema.columns), rows = reduced(schema.rows);
  std::vector<double> sum(columns * rows), weight(columns * rows);
  Detail detail;
  detail.level = std::min(1U, store.top());
  const stream::Channel& channel = schema.coordinates[2];
  for_each_wanted(
      store, detail,
      [&](stream::ClusterId, const stream::ClusterRecord&, const stream::ClusterPoints& points) {
        for (const stream::Point3& p : points.positions) {
          const auto column = static_cast<std::size_t>(p[0]) / reduction;
          const auto row = static_cast<std::size_t>(p[1]) / reduction;
          const std::size_t cell = row * columns + column;
          sum[cell] += p[2] * channel.scale + channel.offset;
          weight[cell] += 1.0;
        }
      });
  if (std::all_of(weight.begin(), weight.end(), [](double w) { return w == 0.0; })) {
    throw stream::Error({.file = store.path().string(),
                         .where = {},
                         .cause = "no sample has data, so nothing can be filled",
                         .remedy = "look at the source's nodata value"});
  }
  grid_.emplace(columns, rows, std::move(sum), std::move(weight));
}

double RasterFill::height(double column, double row) const {
  return grid_->height((column + 0.5) / reduction_, (row + 0.5) / reduction_);
}

std::uint64_t RasterFill::digest(const LatticeWindow& window) const {
  if (window.columns <= 0 || window.rows <= 0) return Digest().value();
  const auto cell = [this](std::int64_t place) {
    return (static_cast<double>(place) + 0.5) / reduction_;
  };
  return grid_->digest(
      {cell(window.column), cell(window.row)},
      {cell(window.column + window.columns - 1), cell(window.row + window.rows - 1)});
}

}  // namespace terrace::terrain
