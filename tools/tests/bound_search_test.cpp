// SPDX-License-Identifier: GPL-3.0-or-later
#include "bound_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

namespace terrace::tools {
namespace {

TEST(BoundSearch, FindsWhatIsNearlyFullInAFewRuns) {
  for (const double power : {0.6, 1.0, 1.7}) {
    for (const double guess : {0.2, 0.9, 1.0, 1.3, 8.0}) {
      SCOPED_TRACE(power);
      SCOPED_TRACE(guess);
      // 1e6 vertices at 0.1, 4 at least.
      const auto vertices = [&](double bound) {
        return static_cast<std::uint64_t>(4 + 1e6 * std::pow(0.1 / std::max(bound, 1e-6), power));
      };
      const double exact = 0.1 * std::pow(1e6 / 5000, 1 / power);
      int runs = 0;
      double last = -1;
      const double found =
          search_bound({5000, 1e4, exact * guess}, [&](double bound) -> std::uint64_t {
            ++runs;
            last = bound;
            return vertices(bound) > 5000 ? 5001 : vertices(bound);
          });
      EXPECT_EQ(last, found);
      EXPECT_LE(vertices(found), 5000U);
      EXPECT_GE(vertices(found), 4850U);
      EXPECT_LE(runs, guess > 0.5 && guess < 2 ? 8 : 14);
    }
  }
}

TEST(BoundSearch, TakesNoErrorWhereAllFit) {
  EXPECT_EQ(search_bound({100, 10, 1}, [](double) { return 50U; }), 0.0);
}

TEST(BoundSearch, TellsWhereNothingFits) {
  EXPECT_LT(search_bound({100, 10, 1}, [](double) { return 200U; }), 0.0);
}

TEST(BoundSearch, EndsAtAStep) {
  // 200 vertices below 3, then 20.
  double last = 0;
  const double found = search_bound({100, 10, 1}, [&](double bound) {
    last = bound;
    return bound < 3 ? 200U : 20U;
  });
  EXPECT_EQ(last, found);
  EXPECT_GE(found, 3);
  EXPECT_LE(found, 3.1);
}

}  // namespace
}  // namespace terrace::tools
