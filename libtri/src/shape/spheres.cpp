// SPDX-License-Identifier: Apache-2.0
#include "spheres.hpp"

#include <limits>

#include "../for_blocks.hpp"

namespace terrace::tri::shape {
namespace {

constexpr std::size_t kSphereBlock = std::size_t{1} << 14;
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

}  // namespace

Spheres::Spheres(std::span<const spatial::Tetrahedron> tetrahedra, std::vector<Place> places,
                 unsigned threads)
    : tetrahedra_(tetrahedra),
      places_(std::move(places)),
      sphere_(tetrahedra.size()),
      ranks_(places_.size()) {
  for (std::size_t v = 0; v < places_.size(); ++v) ranks_[v] = places_[v].rank;
  for_blocks(
      tetrahedra.size(), kSphereBlock, threads, [] { return 0; },
      [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t t = begin; t < end; ++t) sphere_[t] = sphere_of(tetrahedra[t]);
      });
}

Spheres::Sphere Spheres::sphere_of(const spatial::Tetrahedron& t) const {
  if (!spatial::is_finite(t.corner)) return {{}, spatial::kGhost};
  std::array<const Place*, 4> p;
  std::array<std::uint32_t, 4> slot = t.corner;
  for (std::size_t i = 0; i < 4; ++i) p[i] = &places_[slot[i]];
  const auto order = [&](std::size_t i, std::size_t j) {
    if (p[j]->rank >= p[i]->rank) return;
    std::swap(p[i], p[j]);
    std::swap(slot[i], slot[j]);
  };
  order(0, 1), order(2, 3), order(0, 2), order(1, 3), order(1, 2);
  const Vector3 b = minus(p[1]->at, p[0]->at);
  const Vector3 c = minus(p[2]->at, p[0]->at);
  const Vector3 d = minus(p[3]->at, p[0]->at);
  const Vector3 cd = cross(c, d), db = cross(d, b), bc = cross(b, c);
  const double volume6 = dot(b, cd);
  // The sum of the absolute values of the six products in it; each has at most 8 roundings.
  const double total = std::abs(b[0]) * (std::abs(c[1] * d[2]) + std::abs(c[2] * d[1])) +
                       std::abs(b[1]) * (std::abs(c[2] * d[0]) + std::abs(c[0] * d[2])) +
                       std::abs(b[2]) * (std::abs(c[0] * d[1]) + std::abs(c[1] * d[0]));
  if (!(std::abs(volume6) > 0x1p-50 * total)) return {{kNoNumber, kNoNumber, kNoNumber}, slot[0]};
  const double bb = dot(b, b), cc = dot(c, c), dd = dot(d, d), by = 2.0 * volume6;
  Vector3 centre;
  for (std::size_t k = 0; k < 3; ++k) centre[k] = (bb * cd[k] + cc * db[k] + dd * bc[k]) / by;
  if (!(largest(centre) < 0x1p250)) centre.fill(kNoNumber);
  return {centre, slot[0]};
}

Vector3 Spheres::hull_normal(Side side) const {
  // Counter-clockwise as seen from outside; sorting turns it round if the permutation is odd.
  std::array<std::uint32_t, 3> f =
      spatial::facet_of(tetrahedra_[spatial::tetrahedron_of(side)], spatial::index_of(side));
  bool odd = false;
  const auto order = [&](std::size_t i, std::size_t j) {
    if (places_[f[j]].rank >= places_[f[i]].rank) return;
    std::swap(f[i], f[j]);
    odd = !odd;
  };
  order(0, 1), order(1, 2), order(0, 1);
  Vector3 normal =
      cross(minus(places_[f[1]].at, places_[f[0]].at), minus(places_[f[2]].at, places_[f[0]].at));
  const double length = std::sqrt(dot(normal, normal));
  for (double& n : normal) n = (odd ? -n : n) / length;
  return normal;
}

double Spheres::facet_defect(Side side) const {
  const std::uint32_t t = spatial::tetrahedron_of(side);
  const std::uint32_t other = spatial::tetrahedron_of(tetrahedra_[t].mate[spatial::index_of(side)]);
  const auto f = spatial::facet_of(tetrahedra_[t], spatial::index_of(side));
  // No branches that the processor could not predict.
  const std::uint32_t r0 = ranks_[f[0]], r1 = ranks_[f[1]], r2 = ranks_[f[2]];
  std::uint32_t first = r1 < r0 ? f[1] : f[0];
  first = r2 < std::min(r0, r1) ? f[2] : first;
  const Vector3 u = to_centre(t, first);
  return defect_between(u, finite(other) ? to_centre(other, first) : hull_normal(side));
}

}  // namespace terrace::tri::shape
