// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/point_mesh_estimate.hpp"

#include <algorithm>

namespace terrace::terrain {
namespace {

/// The middle's share of a cell's width and height: about an eighth of its area.
constexpr double kMiddle = 0.35;
/// With fewer samples there the whole cell is taken.
constexpr std::size_t kFewSamples = 500;

}  // namespace

PointMeshEstimate::PointMeshEstimate(const PointMeshCuts& cuts, PointMeshSamples& samples,
                                     tri::PointDuplicates duplicates)
    : cuts_(cuts), samples_(samples) {
  options_.quality = tri::TinQuality::kGreedy;
  // They are refused elsewhere.
  options_.duplicates =
      duplicates == tri::PointDuplicates::kError ? tri::PointDuplicates::kFirst : duplicates;
}

double PointMeshEstimate::in_cell(std::uint32_t number, double max_error) const {
  const PointMeshCuts::Cell& cell = cuts_.cells[number];
  PlaneBox box;
  for (std::size_t k = 0; k < 2; ++k) {
    const double middle = cell.low[k] / 2.0 + cell.high[k] / 2.0;
    const double reach = kMiddle * (cell.high[k] - cell.low[k]) / 2.0;
    box.min[k] = middle - reach;
    box.max[k] = middle + reach;
  }
  MeshSamples samples;
  samples_.read(number, 1, box, samples);
  if (samples.size() < kFewSamples) {
    samples = {};
    samples_.read(number, 1, {}, samples);
  }
  tri::PointTinOptions options = options_;
  options.max_error = max_error;
  const tri::PointTin tin = tri::point_tin(samples.x, samples.y, samples.z, {}, options);
  return static_cast<double>(tin.inserted) * static_cast<double>(samples_.count(number, 1)) /
         static_cast<double>(samples.size());
}

double PointMeshEstimate::per_cell(double max_error) const {
  const auto count = static_cast<std::uint32_t>(cuts_.cells.size());
  double vertices = 0.0;
  for (const std::uint32_t k : {1U, 3U, 5U, 7U}) vertices += in_cell(count * k / 8, max_error);
  return vertices / 4.0;
}

}  // namespace terrace::terrain
