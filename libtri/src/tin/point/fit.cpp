// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "removal.hpp"
#include "tin/lattice.hpp"
#include "tin/scan.hpp"

namespace terrace::tri::tin::points {
namespace {

/// Narrows the range by which v may rise for a sample in the triangle v, a, b.
void narrow(Interval& interval, const Vertex& v, const Vertex& a, const Vertex& b,
            const Sample& sample, double bound) {
  // Samples where the vertex has a smaller weight are ignored.
  constexpr double kLeast = 1e-9;
  const auto part = [&](const Vertex& p, const Vertex& q) {
    const double area = (p.x - sample.x) * (q.y - sample.y) - (p.y - sample.y) * (q.x - sample.x);
    return area > 0 ? area : 0;
  };
  const double wv = part(a, b);
  const double wa = part(b, v);
  const double wb = part(v, a);
  const double sum = wv + wa + wb;
  if (!(wv > kLeast * sum)) return;
  // Heights are relative to the vertex's current one.
  const double others = (wa * (a.z - v.z) + wb * (b.z - v.z)) / sum;
  const double wanted = sample.z - v.z - others;
  interval.low = std::max(interval.low, (wanted - bound) * sum / wv);
  interval.high = std::min(interval.high, (wanted + bound) * sum / wv);
}

bool within(const Mesh& mesh, const Star& star, double bound) {
  const Pool<Sample>& samples = *mesh.samples;
  for (std::size_t k = 0; k < star.size(); ++k) {
    const Triangle& t = mesh.triangles[star.triangle(k)];
    for (std::uint32_t i = mesh.heads[star.triangle(k)]; i != kNone; i = samples[i].next)
      if (!(std::abs(height_in(mesh, t, samples[i].x, samples[i].y) - samples[i].z) <= bound))
        return false;
  }
  return true;
}

}  // namespace

void fit_heights(Mesh& mesh, std::size_t fixed, double bound,
                 const std::optional<TinLattice>& lattice) {
  const Pool<Sample>& samples = *mesh.samples;
  const std::vector<std::uint32_t> triangle_of =
      triangle_of_vertices(mesh.triangles, mesh.vertices.size());
  Star star;
  for (auto v = static_cast<std::uint32_t>(fixed); v < mesh.vertices.size(); ++v) {
    if (triangle_of[v] == kNone || !star.gather(mesh.triangles, v, triangle_of[v])) continue;
    Vertex& vertex = mesh.vertices[v];
    Interval interval;
    for (std::size_t k = 0; k < star.size() && interval.low < interval.high; ++k) {
      const Vertex& a = mesh.vertices[star.ring(k)];
      const Vertex& b = mesh.vertices[star.ring(k + 1 == star.size() ? 0 : k + 1)];
      for (std::uint32_t i = mesh.heads[star.triangle(k)]; i != kNone; i = samples[i].next)
        narrow(interval, vertex, a, b, samples[i], bound);
    }
    // If no height satisfies all samples the vertex stays, because a compromise would break the
    // bound.
    if (!(interval.low < interval.high && interval.high - interval.low < HUGE_VAL)) continue;
    const double before = vertex.z;
    vertex.z += interval.low / 2 + interval.high / 2;
    if (lattice) vertex.z = on_lattice(*lattice, vertex.z);
    if (!within(mesh, star, bound)) vertex.z = before;
  }
}

}  // namespace terrace::tri::tin::points
