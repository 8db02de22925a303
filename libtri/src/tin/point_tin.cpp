// SPDX-License-Identifier: GPL-3.0-or-later
#include "terrace/tri/point_tin.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "lattice.hpp"
#include "point_greedy.hpp"
#include "point_lists.hpp"
#include "point_samples.hpp"
#include "point_start.hpp"

namespace terrace::tri {
namespace {

using namespace tin::points;
using tin::kNone;

constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();

void check_options(const PointTinOptions& options, std::span<const Point3> frame) {
  if (!(options.max_error >= 0) || !std::isfinite(options.max_error))
    throw std::invalid_argument("point_tin: max_error is not a number of at least 0");
  if (!(options.min_angle_degrees >= 0 && options.min_angle_degrees <= 30))
    throw std::invalid_argument("point_tin: min_angle_degrees is not within 0 to 30");
  if (!options.lattice) return;
  if (!tin::valid(*options.lattice))
    throw std::invalid_argument("point_tin: a lattice needs a step above 0");
  if (frame.empty()) throw std::invalid_argument("point_tin: a lattice needs a frame");
  for (std::size_t i = 0; i < frame.size(); ++i)
    for (std::size_t k = 0; k < 2; ++k)
      if (!(frame[i][k] >= 0 && frame[i][k] < 0x1p30 && frame[i][k] == std::floor(frame[i][k])))
        throw std::invalid_argument("point_tin: vertex " + std::to_string(i) +
                                    " of the frame is not on the lattice");
}

/// While triangles are large, few of their samples choose the vertices as well as all, and need not
/// be dealt anew each time.
void insert_greedily(Mesh& mesh, Greedy& greedy, double bound, std::size_t max_vertices) {
  constexpr std::uint32_t kSteps[] = {64, 8, 1};
  constexpr std::size_t kSamplesPerTriangle = 8;
  for (const std::uint32_t step : kSteps) {
    const std::size_t listed = mesh.samples->size() / step;
    if (step > 1 && listed < 1024) continue;
    list_samples(mesh, step, bound);
    greedy.take_all();
    greedy.run(max_vertices, step > 1 ? listed / kSamplesPerTriangle : kUnlimited);
  }
}

}  // namespace

PointTin point_tin(std::span<const double> x, std::span<const double> y, std::span<const double> z,
                   std::span<const Point3> frame, const PointTinOptions& options) {
  check_options(options, frame);
  Samples samples = take_samples(x, y, z, options.duplicates);
  Mesh mesh;
  mesh.samples = &samples.all;
  if (frame.empty()) {
    start_with_hull(mesh);
  } else {
    start_with_frame(mesh, frame);
  }
  PointTin result;
  result.duplicates = samples.duplicates;
  result.errors.uncovered = samples.all.size();
  if (mesh.triangles.size() == 0) return result;
  const std::size_t fixed = mesh.vertices.size();
  const std::size_t max_vertices = options.max_points == 0 ? kUnlimited : options.max_points;
  Greedy greedy(mesh, options.max_error, !frame.empty(), options.lattice);
  insert_greedily(mesh, greedy, options.max_error, max_vertices);
  Measured measured = list_samples(mesh, 1, options.max_error);
  // What rounding hid from the lists, next to never.
  while (measured.to_mend > 0 && mesh.vertices.size() < max_vertices) {
    greedy.take_all();
    greedy.run(max_vertices, kUnlimited);
    measured = list_samples(mesh, 1, options.max_error);
  }
  result.inserted = mesh.vertices.size() - fixed;
  result.errors = measured.errors;
  result.stuck = measured.above - measured.to_mend;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vertex& vertex = mesh.vertices[v];
    result.vertices.push_back({vertex.x, vertex.y, vertex.z});
    result.sample.push_back(vertex.sample == kNone ? kNoSample
                                                   : number(samples.all[vertex.sample]));
  }
  for (const tin::Triangle& triangle : mesh.triangles)
    if (triangle.live()) result.triangles.push_back(triangle.corner);
  return result;
}

}  // namespace terrace::tri
