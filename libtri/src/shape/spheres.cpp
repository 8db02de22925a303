// SPDX-License-Identifier: Apache-2.0
#include "spheres.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include <terrace/base/parallel.hpp>
#include <terrace/base/stop_check.hpp>

namespace terrace::tri::shape {
namespace {

constexpr std::size_t kSphereBlock = std::size_t{1} << 14;
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

}  // namespace

Renumbered in_order_of_vertices(std::span<const spatial::Tetrahedron> tetrahedra,
                                std::span<const Place> places, unsigned threads) {
  // Keeps the ranks close together in memory.
  std::vector<std::uint32_t> ranks(places.size());
  for (std::size_t v = 0; v < places.size(); ++v) ranks[v] = places[v].rank;
  Renumbered result;
  const auto slots = static_cast<std::uint32_t>(tetrahedra.size());
  result.number.resize(slots);
  Pool<std::uint8_t> turn;  // 0 for a free slot
  turn.resize(slots);
  std::vector<std::uint32_t> next(places.size());
  std::uint32_t count = 0;
  for (std::uint32_t t = 0; t < slots; ++t) {
    const auto& corner = tetrahedra[t].corner;
    turn[t] = 0;
    if (corner[0] == spatial::kFreeCorner) continue;
    turn[t] = turn_of(corner, [&](std::uint32_t v) { return ranks[v]; });
    ++next[result.number[t] = corner[kTurns[turn[t]].from[0]]];
    ++count;
  }
  std::exclusive_scan(next.begin(), next.end(), next.begin(), std::uint32_t{0});
  for (std::uint32_t t = 0; t < slots; ++t)
    if (turn[t] != 0) result.number[t] = next[result.number[t]]++;
  result.tetrahedra.resize(count);
  const auto new_side = [&](spatial::Side mate) {
    const std::uint32_t other = spatial::tetrahedron_of(mate);
    return spatial::make_side(result.number[other],
                              kTurns[turn[other]].to[spatial::index_of(mate)]);
  };
  base::parallel_blocks(slots, kSphereBlock, threads, [&](std::size_t begin, std::size_t end) {
    for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) {
      if (turn[t] == 0) continue;
      result.tetrahedra[result.number[t]] =
          rotate_corners(tetrahedra[t], kTurns[turn[t]], new_side);
    }
  });
  return result;
}

Spheres::Spheres(std::span<const spatial::Tetrahedron> tetrahedra, std::vector<Place> places,
                 unsigned threads, const base::StopCheck& check_stop)
    : tetrahedra_(tetrahedra), places_(std::move(places)) {
  sphere_.resize(static_cast<std::uint32_t>(tetrahedra.size()));
  finite_.resize(static_cast<std::uint32_t>(tetrahedra.size()));
  base::parallel_blocks(tetrahedra.size(), kSphereBlock, threads,
                        [&](std::size_t begin, std::size_t end) {
                          if (check_stop) check_stop();
                          for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) {
                            finite_[t] = spatial::is_finite(tetrahedra[t].corner);
                            if (finite(t)) sphere_[t] = sphere_of(tetrahedra[t]);
                          }
                        });
}

Spheres::Sphere Spheres::sphere_of(const spatial::Tetrahedron& t) const {
  const Vector3& a = places_[t.corner[0]].at;
  const auto to = [&](std::uint32_t v) { return minus(places_[v].at, a); };
  const bool in_order = places_[t.corner[2]].rank < places_[t.corner[3]].rank;
  const Vector3 b = to(t.corner[1]), c = to(t.corner[in_order ? 2 : 3]),
                d = to(t.corner[in_order ? 3 : 2]);
  const Vector3 cd = cross(c, d), db = cross(d, b), bc = cross(b, c);
  const double volume6 = dot(b, cd);
  // The sum of the absolute values of the six products in it. Each has at most 8 roundings.
  const double total = std::abs(b[0]) * (std::abs(c[1] * d[2]) + std::abs(c[2] * d[1])) +
                       std::abs(b[1]) * (std::abs(c[2] * d[0]) + std::abs(c[0] * d[2])) +
                       std::abs(b[2]) * (std::abs(c[0] * d[1]) + std::abs(c[1] * d[0]));
  if (!(std::abs(volume6) > 0x1p-50 * total))
    return {{kNoNumber, kNoNumber, kNoNumber}, t.corner[0]};
  const double bb = dot(b, b), cc = dot(c, c), dd = dot(d, d), by = 2.0 * volume6;
  Vector3 centre;
  for (std::size_t k = 0; k < 3; ++k) centre[k] = (bb * cd[k] + cc * db[k] + dd * bc[k]) / by;
  if (!(largest(centre) < 0x1p250)) centre.fill(kNoNumber);
  return {centre, t.corner[0]};
}

Vector3 Spheres::hull_normal(Side side) const {
  // Counter-clockwise as seen from outside. Sorting reverses it if the permutation is odd.
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
  // The first corner of the facet.
  const Vector3& at = places_[tetrahedra_[t].corner[spatial::index_of(side) == 0 ? 1 : 0]].at;
  const Vector3 u = to_centre(t, at);
  return defect_between(u, finite(other) ? to_centre(other, at) : hull_normal(side));
}

}  // namespace terrace::tri::shape
