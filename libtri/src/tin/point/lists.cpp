// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "refinement.hpp"

namespace terrace::tri::tin::points {
namespace {

/// Adds up the errors of samples and stores the worst sample of each triangle.
class ErrorSum {
 public:
  explicit ErrorSum(double bound) : bound_(bound) {}

  void add(PointMesh& mesh, std::uint32_t at, const Sample& sample, std::uint32_t index) {
    Triangle& triangle = mesh.triangles[at];
    const double error = std::abs(height_in(mesh, triangle, sample.x, sample.y) - sample.z);
    squares_ += error * error;
    if (error > result.errors.largest) {
      result.errors.largest = error;
      result.errors.largest_at = number(sample);
    }
    if (!(error > bound_)) return;
    ++result.above;
    if (stuck(sample)) return;
    ++result.insertable;
    if (!(triangle.error > 0)) result.triangles_to_refine.push_back(at);
    if (rounded_up(error) > triangle.error) {
      triangle.error = rounded_up(error);
      triangle.place = index;
    }
  }
  Measured finish() {
    if (result.errors.covered > 0)
      result.errors.rms = std::sqrt(squares_ / static_cast<double>(result.errors.covered));
    return std::move(result);
  }

  Measured result;

 private:
  double bound_, squares_ = 0;
};

std::uint32_t first_live(const Triangles& triangles) {
  std::uint32_t t = 0;
  while (!triangles[t].live()) ++t;
  return t;
}

}  // namespace

Measured list_samples(PointRefinement& refinement, std::uint32_t step) {
  PointMesh& mesh = refinement.mesh();
  Pool<Sample>& samples = refinement.samples().all();
  Pool<std::uint32_t>& heads = refinement.samples().heads();
  for (std::uint32_t& head : span_of(heads)) head = kNone;
  for (Triangle& triangle : mesh.triangles) triangle.error = 0;
  ErrorSum sum(refinement.samples().bound());
  // Consecutive samples are close to each other, so walks are short.
  std::uint32_t at = first_live(mesh.triangles);
  base::StopTicks ticks = refinement.ticks();
  for (std::uint64_t i = 0; i < samples.size(); i += step) {
    ticks(128);
    const auto index = static_cast<std::uint32_t>(i);
    Sample& sample = samples[index];
    if (sample.next == kIsVertex) {
      ++sum.result.errors.covered;
      continue;
    }
    const Spot spot = refinement.locate(sample, at);
    if (spot.triangle == kNone) {
      sample.next = kOutside;
      ++sum.result.errors.uncovered;
      continue;
    }
    at = spot.triangle;
    sample.next = heads[at];
    heads[at] = index;
    ++sum.result.errors.covered;
    sum.add(mesh, at, sample, index);
  }
  return sum.finish();
}

Measured measure_lists(PointRefinement& refinement) {
  PointMesh& mesh = refinement.mesh();
  const Pool<Sample>& samples = refinement.samples().all();
  const Pool<std::uint32_t>& heads = refinement.samples().heads();
  ErrorSum sum(refinement.samples().bound());
  for (std::uint32_t i = 0; i < samples.size(); ++i)
    (samples[i].next == kOutside ? sum.result.errors.uncovered : sum.result.errors.covered) += 1;
  base::StopTicks ticks = refinement.ticks();
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    ticks(64);
    Triangle& triangle = mesh.triangles[t];
    triangle.error = 0;
    if (!triangle.live() || heads[t] == kNone) continue;
    const Place2 a = place(mesh.vertex(triangle, 0));
    const Place2 b = place(mesh.vertex(triangle, 1));
    const Place2 c = place(mesh.vertex(triangle, 2));
    for (std::uint32_t i = heads[t]; i != kNone; i = samples[i].next) {
      const Sample& sample = samples[i];
      const Place2 p = place(sample);
      // Rounding has put the sample into the wrong list, so all lists are rebuilt.
      if (Kernel::orientation(a, b, p) < 0 || Kernel::orientation(b, c, p) < 0 ||
          Kernel::orientation(c, a, p) < 0)
        return list_samples(refinement, 1);
      sum.add(mesh, t, sample, i);
    }
  }
  return sum.finish();
}

void sweep(PointRefinement& refinement, std::uint32_t step) {
  PointMesh& mesh = refinement.mesh();
  PointSamples& samples = refinement.samples();
  Pool<Sample>& all = samples.all();
  std::uint32_t at = first_live(mesh.triangles);
  base::StopTicks ticks = refinement.ticks();
  for (std::uint64_t i = 0; i < all.size(); i += step) {
    ticks(512);
    const auto index = static_cast<std::uint32_t>(i);
    Sample& sample = all[index];
    if (sample.next == kIsVertex) continue;
    const Spot found = refinement.locate(sample, at);
    if (found.triangle == kNone) continue;
    at = found.triangle;
    const double height = height_in(mesh, mesh.triangles[at], sample.x, sample.y);
    if (!(std::abs(height - sample.z) > samples.bound())) continue;
    const Vertex vertex = samples.take(index);
    const Spot spot = refinement.free_spot(vertex, at);
    if (spot.triangle == kNone) continue;
    at = refinement.insert(vertex, spot).front();
    if (!samples.on_lattice()) sample.next = kIsVertex;
  }
  samples.add_lists(mesh.triangles);
}

}  // namespace terrace::tri::tin::points
