// SPDX-License-Identifier: Apache-2.0
// Pairs five points so that the total distance is minimal. One point is left over.
#include <cstdio>
#include <vector>

#include <terrace/matching/point_matching.hpp>

int main() {
  using terrace::matching::Point2;
  const std::vector<Point2> places{{0, 0}, {9, 9}, {1, 0}, {5, 4}, {5, 5}};
  const auto best = terrace::matching::match_points(places);
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (best.mate[i] != terrace::matching::kNone) std::printf("%zu-%u ", i, best.mate[i]);
  }
  std::printf("cost %g, at least %g, left over: %u\n", best.cost, best.dual_bound, best.left_over);
  return best.cost == 2.0 && best.left_over == 1 ? 0 : 1;
}
