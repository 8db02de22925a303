// SPDX-License-Identifier: Apache-2.0
#include "lists.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrace::tri::tin::points {
namespace {

/// Adds up the errors of samples, and notes the worst one of each triangle.
class ErrorSum {
 public:
  explicit ErrorSum(double bound) : bound_(bound) {}

  void add(Mesh& mesh, std::uint32_t at, std::uint32_t index) {
    const Sample& sample = (*mesh.samples)[index];
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
    ++result.to_mend;
    if (!(triangle.error > 0)) result.waiting.push_back(at);
    if (rounded_up(error) > triangle.error) {
      triangle.error = rounded_up(error);
      triangle.place = index;
    }
  }
  Measured done() {
    if (result.errors.covered > 0)
      result.errors.rms = std::sqrt(squares_ / static_cast<double>(result.errors.covered));
    return std::move(result);
  }

  Measured result;

 private:
  double bound_, squares_ = 0;
};

}  // namespace

Measured list_samples(Mesh& mesh, std::uint32_t step, double bound) {
  Pool<Sample>& samples = *mesh.samples;
  for (std::uint32_t& head : span_of(mesh.heads)) head = kNone;
  for (Triangle& triangle : mesh.triangles) triangle.error = 0;
  ErrorSum sum(bound);
  // Consecutive samples are close to each other, so walks are short.
  std::uint32_t at = 0;
  while (!mesh.triangles[at].live()) ++at;
  for (std::uint64_t i = 0; i < samples.size(); i += step) {
    const auto index = static_cast<std::uint32_t>(i);
    Sample& sample = samples[index];
    if (sample.next == kIsVertex) {
      ++sum.result.errors.covered;
      continue;
    }
    const Spot spot = mesh.locate({sample.x, sample.y}, at);
    if (spot.triangle == kNone) {
      sample.next = kOutside;
      ++sum.result.errors.uncovered;
      continue;
    }
    at = spot.triangle;
    sample.next = mesh.heads[at];
    mesh.heads[at] = index;
    ++sum.result.errors.covered;
    sum.add(mesh, at, index);
  }
  return sum.done();
}

Measured measure_lists(Mesh& mesh, double bound) {
  const Pool<Sample>& samples = *mesh.samples;
  ErrorSum sum(bound);
  for (std::uint32_t i = 0; i < samples.size(); ++i)
    (samples[i].next == kOutside ? sum.result.errors.uncovered : sum.result.errors.covered) += 1;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    Triangle& triangle = mesh.triangles[t];
    triangle.error = 0;
    if (!triangle.live() || mesh.heads[t] == kNone) continue;
    const Place2 a = mesh.place(triangle.corner[0]);
    const Place2 b = mesh.place(triangle.corner[1]);
    const Place2 c = mesh.place(triangle.corner[2]);
    for (std::uint32_t i = mesh.heads[t]; i != kNone; i = samples[i].next) {
      const Sample& sample = samples[i];
      const Place2 p{sample.x, sample.y};
      // Rounding has put the sample into the wrong list, so all lists are rebuilt.
      if (Kernel::orientation(a, b, p) < 0 || Kernel::orientation(b, c, p) < 0 ||
          Kernel::orientation(c, a, p) < 0)
        return list_samples(mesh, 1, bound);
      sum.add(mesh, t, i);
    }
  }
  return sum.done();
}

}  // namespace terrace::tri::tin::points
