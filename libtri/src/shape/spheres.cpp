// SPDX-License-Identifier: Apache-2.0
#include "spheres.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "../for_blocks.hpp"

namespace terrace::tri::shape {
namespace {

constexpr std::size_t kSphereBlock = std::size_t{1} << 14;
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

}  // namespace

Renumbered in_order_of_vertices(std::span<const spatial::Tetrahedron> tetrahedra,
                                std::size_t vertex_slots, unsigned threads) {
  const auto free = [](const spatial::Tetrahedron& t) {
    return t.corner[0] == spatial::kFreeCorner;
  };
  const auto first_vertex = [](const spatial::Tetrahedron& t) {
    // The ghost, 0, counts as the last.
    static_assert(spatial::kGhost == 0);
    std::uint32_t first = ~std::uint32_t{0};
    for (const std::uint32_t v : t.corner) first = std::min(first, v - 1);
    return first;
  };
  Renumbered result;
  result.number.resize(static_cast<std::uint32_t>(tetrahedra.size()));
  std::vector<std::uint32_t> next(vertex_slots);
  std::uint32_t count = 0;
  for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
    if (free(tetrahedra[t])) continue;
    ++next[result.number[t] = first_vertex(tetrahedra[t])];
    ++count;
  }
  std::exclusive_scan(next.begin(), next.end(), next.begin(), std::uint32_t{0});
  for (std::uint32_t t = 0; t < tetrahedra.size(); ++t)
    if (!free(tetrahedra[t])) result.number[t] = next[result.number[t]]++;
  result.tetrahedra.resize(count);
  for_blocks(
      tetrahedra.size(), kSphereBlock, threads, [] { return 0; },
      [&](std::size_t begin, std::size_t end, int) {
        for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) {
          if (free(tetrahedra[t])) continue;
          spatial::Tetrahedron& to = result.tetrahedra[result.number[t]];
          to = tetrahedra[t];
          for (spatial::Side& mate : to.mate) {
            mate = spatial::make_side(result.number[spatial::tetrahedron_of(mate)],
                                      spatial::index_of(mate));
          }
        }
      });
  return result;
}

Spheres::Spheres(std::span<const spatial::Tetrahedron> tetrahedra, std::vector<Place> places,
                 unsigned threads)
    : tetrahedra_(tetrahedra), places_(std::move(places)), ranks_(places_.size()) {
  sphere_.resize(static_cast<std::uint32_t>(tetrahedra.size()));
  for (std::size_t v = 0; v < places_.size(); ++v) ranks_[v] = places_[v].rank;
  for_blocks(
      tetrahedra.size(), kSphereBlock, threads, [] { return 0; },
      [&](std::size_t begin, std::size_t end, int) {
        for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t)
          sphere_[t] = sphere_of(tetrahedra[t]);
      });
}

Spheres::Sphere Spheres::sphere_of(const spatial::Tetrahedron& t) const {
  if (!spatial::is_finite(t.corner)) return {{}, spatial::kGhost};
  std::array<std::uint64_t, 4> key;
  for (std::size_t i = 0; i < 4; ++i) key[i] = key_of(t.corner[i]);
  const auto order = [&](std::size_t i, std::size_t j) {
    const std::uint64_t low = std::min(key[i], key[j]);
    key[j] = std::max(key[i], key[j]);
    key[i] = low;
  };
  order(0, 1), order(2, 3), order(0, 2), order(1, 3), order(1, 2);
  const auto place = [&](std::size_t i) { return places_[vertex_of(key[i])].at; };
  const Vector3 a = place(0);
  const Vector3 b = minus(place(1), a), c = minus(place(2), a), d = minus(place(3), a);
  const Vector3 cd = cross(c, d), db = cross(d, b), bc = cross(b, c);
  const double volume6 = dot(b, cd);
  // The sum of the absolute values of the six products in it; each has at most 8 roundings.
  const double total = std::abs(b[0]) * (std::abs(c[1] * d[2]) + std::abs(c[2] * d[1])) +
                       std::abs(b[1]) * (std::abs(c[2] * d[0]) + std::abs(c[0] * d[2])) +
                       std::abs(b[2]) * (std::abs(c[0] * d[1]) + std::abs(c[1] * d[0]));
  if (!(std::abs(volume6) > 0x1p-50 * total))
    return {{kNoNumber, kNoNumber, kNoNumber}, vertex_of(key[0])};
  const double bb = dot(b, b), cc = dot(c, c), dd = dot(d, d), by = 2.0 * volume6;
  Vector3 centre;
  for (std::size_t k = 0; k < 3; ++k) centre[k] = (bb * cd[k] + cc * db[k] + dd * bc[k]) / by;
  if (!(largest(centre) < 0x1p250)) centre.fill(kNoNumber);
  return {centre, vertex_of(key[0])};
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
  const std::uint32_t first = vertex_of(std::min({key_of(f[0]), key_of(f[1]), key_of(f[2])}));
  const Vector3& at = places_[first].at;
  const Vector3 u = to_centre(t, at);
  return defect_between(u, finite(other) ? to_centre(other, at) : hull_normal(side));
}

}  // namespace terrace::tri::shape
