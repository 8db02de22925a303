// SPDX-License-Identifier: GPL-3.0-or-later
#include "point_measure.hpp"

#include <cmath>
#include <vector>

namespace terrace::tri::tin {
namespace {

bool contains(const Mesh& mesh, const Triangle& t, const Place2& p) {
  for (unsigned i = 0; i < 3; ++i)
    if (Kernel::orientation(mesh.place(t.vertex[i]), mesh.place(t.vertex[next3(i)]), p) < 0)
      return false;
  return true;
}

void settle(Mesh& mesh) {
  Pool<Sample>& samples = *mesh.samples;
  std::vector<std::uint32_t> moving;
  std::vector<std::uint32_t> from;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!mesh.alive(t)) continue;
    std::uint32_t* link = &mesh.triangles[t].head;
    for (std::uint32_t i = *link; i != kNone; i = *link) {
      if (contains(mesh, mesh.triangles[t], {samples[i].x, samples[i].y})) {
        link = &samples[i].next;
      } else {
        *link = samples[i].next;
        moving.push_back(i);
        from.push_back(t);
      }
    }
  }
  for (std::size_t k = 0; k < moving.size(); ++k) {
    Sample& sample = samples[moving[k]];
    const std::uint32_t t = mesh.locate({sample.x, sample.y}, from[k]).triangle;
    // Listed samples are inside the region.
    sample.next = mesh.triangles[t].head;
    mesh.triangles[t].head = moving[k];
  }
}

}  // namespace

Measured measure_lists(Mesh& mesh, double bound) {
  settle(mesh);
  const Pool<Sample>& samples = *mesh.samples;
  Measured result;
  double squares = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!mesh.alive(t)) continue;
    const Triangle& triangle = mesh.triangles[t];
    for (std::uint32_t i = triangle.head; i != kNone; i = samples[i].next) {
      const Sample& sample = samples[i];
      const double error = std::abs(height_in(mesh, triangle, sample.x, sample.y) - sample.z);
      squares += error * error;
      ++result.errors.covered;
      if (error > bound) {
        ++result.above;
        result.to_mend += stuck(sample) ? 0 : 1;
      }
      if (error > result.errors.largest) {
        result.errors.largest = error;
        result.errors.largest_at = number(sample);
      }
    }
  }
  // Samples in no list that are no vertices are outside.
  for (std::uint32_t i = 0; i < samples.size(); ++i)
    result.errors.covered += samples[i].next == kIsVertex ? 1 : 0;
  if (result.errors.covered > 0)
    result.errors.rms = std::sqrt(squares / static_cast<double>(result.errors.covered));
  return result;
}

}  // namespace terrace::tri::tin
