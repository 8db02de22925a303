// SPDX-License-Identifier: Apache-2.0
#include "ground.hpp"

#include <array>
#include <stdexcept>
#include <string>

namespace terrace::cluster {
namespace {

// Points are processed four at a time, in twelve independent lanes that the compiler vectorises.
constexpr std::size_t kGroup = 4;

}  // namespace

std::size_t first_not_finite(std::span<const Point3> positions) {
  // 0 * x is zero for finite x and NaN otherwise. A NaN stays in the sum.
  std::array<double, 3 * kGroup> sum{};
  std::size_t i = 0;
  for (; i + kGroup <= positions.size(); i += kGroup) {
    for (std::size_t j = 0; j < 3 * kGroup; ++j) sum[j] += 0.0 * positions[i + j / 3][j % 3];
  }
  double total = 0.0;
  for (const double s : sum) total += s;
  for (; i < positions.size(); ++i) {
    for (const double x : positions[i]) total += 0.0 * x;
  }
  if (total == 0.0) return positions.size();
  const auto bad = std::find_if(positions.begin(), positions.end(), [](const Point3& p) {
    return !(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]));
  });
  return static_cast<std::size_t>(bad - positions.begin());
}

void check_ground_map(const GroundMap& map, const Box3& box, unsigned level, std::uint64_t block) {
  const auto fail = [&](const std::string& what) {
    throw std::invalid_argument("block " + std::to_string(block) + " of level " +
                                std::to_string(level) + ": " + what);
  };
  const bool finite =
      std::all_of(map.begin(), map.end(), [](double entry) { return std::isfinite(entry); });
  if (!finite) fail("the ground map has an entry that is not finite");
  if (std::all_of(map.begin(), map.end(), [](double entry) { return entry == 0.0; })) {
    fail("the ground map is zero, so all distances would be zero");
  }
  if (!(ground_extent(map, box) <= 1e150)) {
    fail("its ground extent is beyond 1e150; check the coordinates and the ground map");
  }
}

void to_ground(std::span<const Point3> positions, const Point3& origin, const GroundMap& map,
               std::span<Point3> out) {
  if (is_diagonal(map)) {
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const Point3 p = difference(positions[i], origin);
      out[i] = {map[0] * p[0], map[4] * p[1], map[8] * p[2]};
    }
    return;
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    out[i] = mapped(map, difference(positions[i], origin));
  }
}

}  // namespace terrace::cluster
