// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/simd.hpp>

#include "grid_windows.hpp"
#include "terrace/tri/delaunay2.hpp"
#include "terrace/tri/grid_tin.hpp"
#include "tin/instruction_set.hpp"

namespace {

using namespace terrace::tri;

using Place = std::array<std::int32_t, 2>;

std::int64_t turn(const Place& a, const Place& b, const Place& c) {
  return std::int64_t{b[0] - a[0]} * (c[1] - a[1]) - std::int64_t{b[1] - a[1]} * (c[0] - a[0]);
}

/// The surface of a selection, measured by brute force.
struct Surface {
  double max_error = 0;
  std::size_t missing_inside = 0;  ///< samples without data in triangles whose corners have data
  std::size_t uncovered = 0;       ///< samples that must be in such a triangle, but are not
};

/// Triangulates the selection with Delaunay2 and measures every sample in every triangle.
template <class T>
Surface surface_of(const OwnedWindow<T>& owned, const std::vector<std::uint32_t>& selection) {
  std::vector<Place> places;
  for (const std::uint32_t number : selection)
    places.push_back({static_cast<std::int32_t>(number % owned.columns),
                      static_cast<std::int32_t>(number / owned.columns)});
  Delaunay2<std::int32_t> triangulation;
  triangulation.build(places);
  const auto height = [&](const Place& p) {
    return static_cast<double>(
        owned.at(static_cast<std::uint32_t>(p[0]), static_cast<std::uint32_t>(p[1])));
  };
  Surface surface;
  std::vector<bool> covered(owned.heights.size());
  std::int64_t area = 0;
  for (const TriangleId t : triangulation.all_triangles()) {
    std::array<Place, 3> corner;
    for (std::size_t k = 0; k < 3; ++k)
      corner[k] = triangulation.point(triangulation.vertices(t)[k]);
    const auto& [a, b, c] = corner;
    area += turn(a, b, c);
    if (!std::isfinite(height(a) + height(b) + height(c))) continue;
    for (std::int32_t y = std::min({a[1], b[1], c[1]}); y <= std::max({a[1], b[1], c[1]}); ++y) {
      for (std::int32_t x = std::min({a[0], b[0], c[0]}); x <= std::max({a[0], b[0], c[0]}); ++x) {
        const Place p{x, y};
        const std::int64_t at_a = turn(b, c, p), at_b = turn(c, a, p), at_c = turn(a, b, p);
        if (at_a < 0 || at_b < 0 || at_c < 0) continue;
        if (!std::isfinite(height(p))) {
          ++surface.missing_inside;
          continue;
        }
        covered[static_cast<std::size_t>(y) * owned.columns + static_cast<std::size_t>(x)] = true;
        // Relative to the sample, so that the result is exact if heights are equal.
        const double sum = static_cast<double>(at_a) * (height(a) - height(p)) +
                           static_cast<double>(at_b) * (height(b) - height(p)) +
                           static_cast<double>(at_c) * (height(c) - height(p));
        surface.max_error =
            std::max(surface.max_error, std::fabs(sum) / static_cast<double>(turn(a, b, c)));
      }
    }
  }
  EXPECT_EQ(area, 2 * std::int64_t{owned.columns - 1} * (owned.rows - 1));
  if (owned.columns < 2 || owned.rows < 2) return surface;
  for (std::uint32_t y = 0; y < owned.rows; ++y) {
    for (std::uint32_t x = 0; x < owned.columns; ++x) {
      bool inner = true;
      for (std::uint32_t v = y == 0 ? 0 : y - 1; v <= y + 1 && v < owned.rows; ++v)
        for (std::uint32_t u = x == 0 ? 0 : x - 1; u <= x + 1 && u < owned.columns; ++u)
          inner = inner && std::isfinite(owned.at(u, v));
      if (inner && !covered[std::size_t{y} * owned.columns + x]) ++surface.uncovered;
    }
  }
  return surface;
}

template <class T>
double range_of(const OwnedWindow<T>& owned) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const T z : owned.heights) {
    if (!std::isfinite(z)) continue;
    low = std::min(low, static_cast<double>(z));
    high = std::max(high, static_cast<double>(z));
  }
  return low <= high ? high - low : 0;
}

/// The numbers of the samples of `sides`, ascending.
std::vector<std::uint32_t> numbers_of(const GridSides& sides, std::uint32_t columns,
                                      std::uint32_t rows) {
  std::vector<std::uint32_t> numbers;
  for (const std::uint32_t x : sides.first_row) numbers.push_back(x);
  for (const std::uint32_t x : sides.last_row) numbers.push_back((rows - 1) * columns + x);
  for (const std::uint32_t y : sides.first_column) numbers.push_back(y * columns);
  for (const std::uint32_t y : sides.last_column) numbers.push_back(y * columns + columns - 1);
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  return numbers;
}

/// Checks everything that select_samples() promises, and returns the selection.
template <class T>
std::vector<std::uint32_t> expect_contract(const OwnedWindow<T>& owned, const GridSides& sides,
                                           double bound) {
  const std::vector<std::uint32_t> selection = select_samples(owned.window(), sides, bound);
  EXPECT_TRUE(std::adjacent_find(selection.begin(), selection.end(), std::greater_equal()) ==
              selection.end());
  std::vector<std::uint32_t> on_sides;
  for (const std::uint32_t number : selection) {
    const std::uint32_t x = number % owned.columns, y = number / owned.columns;
    EXPECT_LT(y, owned.rows);
    if (x == 0 || y == 0 || x + 1 == owned.columns || y + 1 == owned.rows)
      on_sides.push_back(number);
  }
  EXPECT_EQ(on_sides, numbers_of(sides, owned.columns, owned.rows));
  const Surface surface = surface_of(owned, selection);
  EXPECT_LE(surface.max_error, std::max(bound, range_of(owned) * 0x1p-40));
  EXPECT_EQ(surface.missing_inside, 0U);
  EXPECT_EQ(surface.uncovered, 0U);
  return selection;
}

/// Adds vertices until the side of samples `height(0)` to `height(count - 1)` is within the bound.
template <class Height>
void keep_bound(std::vector<std::uint32_t>& side, double bound, const Height& height) {
  for (std::size_t k = 1; k < side.size();) {
    const std::uint32_t from = side[k - 1], to = side[k];
    const double rise = height(to) - height(from);
    double worst_error = std::max(bound, std::fabs(rise) * 0x1p-45);
    std::uint32_t worst = to;
    for (std::uint32_t i = from + 1; i < to; ++i) {
      const double error = std::fabs(height(i) - height(from) - rise * (i - from) / (to - from));
      if (!(error > worst_error)) continue;
      worst_error = error;
      worst = i;
    }
    if (worst == to) {
      ++k;
    } else {
      side.insert(side.begin() + static_cast<std::ptrdiff_t>(k), worst);
    }
  }
}

/// Adds every sample to a side with this chance, and more where the bound needs them.
template <class T>
GridSides with_more(const OwnedWindow<T>& owned, GridSides sides, double bound, double chance,
                    std::mt19937_64& random) {
  const std::uint32_t columns = owned.columns, rows = owned.rows;
  const auto add = [&](std::vector<std::uint32_t>& side, std::uint32_t count, const auto& sample) {
    for (std::uint32_t i = 0; i < count; ++i)
      if (static_cast<double>(random() >> 11) * 0x1p-53 < chance) side.push_back(i);
    std::sort(side.begin(), side.end());
    side.erase(std::unique(side.begin(), side.end()), side.end());
    keep_bound(side, bound * (1 - 1e-5),
               [&](std::uint32_t i) { return static_cast<double>(sample(i)); });
  };
  add(sides.first_row, columns, [&](std::uint32_t x) { return owned.at(x, 0); });
  add(sides.last_row, columns, [&](std::uint32_t x) { return owned.at(x, rows - 1); });
  add(sides.first_column, rows, [&](std::uint32_t y) { return owned.at(0, y); });
  add(sides.last_column, rows, [&](std::uint32_t y) { return owned.at(columns - 1, y); });
  return sides;
}

template <class T>
void expect_contract(std::uint32_t columns, std::uint32_t rows, std::uint64_t seed) {
  for (const Relief relief : kReliefs) {
    for (const Gaps gaps : kGapPatterns) {
      SCOPED_TRACE(describe(relief, gaps, columns, rows, seed));
      const auto owned = make_window<T>(relief, gaps, columns, rows, seed);
      const double medium = bound_for(relief);
      std::mt19937_64 random(seed);
      for (const double bound : {0.0, medium * 1e-3, medium * 0.3, medium, medium * 1e6}) {
        SCOPED_TRACE("bound " + std::to_string(bound / medium) + " of the medium one");
        const GridSides sides = settle_sides(owned.window(), bound);
        expect_contract(owned, sides, bound);
        expect_contract(owned, settle_sides(owned.window(), bound * 0.5), bound);
        for (const double chance : {0.1, 1.0})
          expect_contract(owned, with_more(owned, sides, bound, chance, random), bound);
      }
    }
  }
}

TEST(SelectSamples, KeepsItsContract) {
  expect_contract<float>(37, 29, 1);
  expect_contract<double>(18, 31, 2);
}

TEST(SelectSamples, KeepsItsContractInSmallWindows) {
  for (std::uint32_t columns = 1; columns <= 6; ++columns) {
    for (std::uint32_t rows = 1; rows <= 6; ++rows) {
      expect_contract<float>(columns, rows, 100 * columns + rows);
      expect_contract<double>(columns, rows, 100 * columns + rows + 50);
    }
  }
}

/// Small integers have many cocircular samples and equal errors, and random gaps many shapes.
TEST(SelectSamples, KeepsItsContractOnRandomSteps) {
  for (std::uint64_t seed = 1; seed <= 3000 / TERRACE_TEST_SHARE; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    OwnedWindow<float> owned{static_cast<std::uint32_t>(2 + random() % 14),
                             static_cast<std::uint32_t>(2 + random() % 14),
                             {}};
    const std::uint64_t steps = 1 + random() % 5,
                        one_in = random() % 3 == 0 ? 2 + random() % 20 : 0;
    for (std::uint32_t i = 0; i < owned.columns * owned.rows; ++i) {
      const auto z = static_cast<float>(random() % steps);
      owned.heights.push_back(one_in != 0 && random() % one_in == 0 ? std::nanf("") : z);
    }
    const double bound = 0.5 * static_cast<double>(random() % 6);
    const GridSides sides = settle_sides(owned.window(), bound * (random() % 2 == 0 ? 1 : 0.7));
    const double chance = random() % 3 == 0 ? 0.2 : 0.0;
    expect_contract(owned, with_more(owned, sides, bound, chance, random), bound);
  }
}

TEST(SelectSamples, KeepsItsContractFarFromZero) {
  for (const double offset : {1e5, 1e9, -1e12}) {
    SCOPED_TRACE("offset " + std::to_string(offset));
    auto owned = make_window<double>(Relief::hills, Gaps::blobs, 60, 50, 6);
    for (double& z : owned.heights) z = z * 1e-3 + offset;
    for (const double bound : {0.0, 0.01, 0.1, 1e3})
      expect_contract(owned, settle_sides(owned.window(), bound), bound);
  }
  auto owned = make_window<float>(Relief::hills, Gaps::islands, 60, 50, 7);
  for (float& z : owned.heights) z += 8e6F;
  for (const double bound : {0.0, 1.0, 20.0})
    expect_contract(owned, settle_sides(owned.window(), bound), bound);
}

TEST(SelectSamples, TakesTheSidesAloneWithoutData) {
  for (const std::uint32_t columns : {1U, 2U, 20U}) {
    for (const std::uint32_t rows : {1U, 2U, 30U}) {
      const OwnedWindow<float> owned{
          columns, rows, std::vector<float>(std::size_t{columns} * rows, std::nanf(""))};
      const GridSides sides = settle_sides(owned.window(), 1);
      EXPECT_EQ(expect_contract(owned, sides, 1), numbers_of(sides, columns, rows));
    }
  }
}

TEST(SelectSamples, TakesTheCornersOfAPlane) {
  for (const Relief relief : {Relief::flat, Relief::ramp}) {
    const auto owned = make_window<float>(relief, Gaps::none, 300, 200, 1);
    for (const double bound : {0.0, 1e-6, 5.0})
      EXPECT_EQ(expect_contract(owned, settle_sides(owned.window(), bound), bound),
                (std::vector<std::uint32_t>{0, 299, 59'700, 59'999}));
  }
}

/// No inner sample of a selection may be left out alone.
TEST(SelectSamples, TakesNoMoreThanNeeded) {
  for (const Relief relief : {Relief::steps, Relief::noise, Relief::hills, Relief::spikes}) {
    const auto owned = make_window<float>(relief, Gaps::none, 40, 30, 9);
    SCOPED_TRACE(describe(relief, Gaps::none, 40, 30, 9));
    for (const double bound : {bound_for(relief) * 0.25, bound_for(relief)}) {
      const auto selection = expect_contract(owned, settle_sides(owned.window(), bound), bound);
      for (std::size_t i = 0; i < selection.size(); ++i) {
        const std::uint32_t x = selection[i] % 40, y = selection[i] / 40;
        if (x == 0 || y == 0 || x == 39 || y == 29) continue;
        auto fewer = selection;
        fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
        // The selection may have rounded its errors up.
        EXPECT_GT(surface_of(owned, fewer).max_error, bound * 0.999) << x << ", " << y;
      }
    }
  }
}

TEST(SelectSamples, SameNumbersOnEveryProcessor) {
  for (const Relief relief : kReliefs) {
    for (const Gaps gaps : {Gaps::none, Gaps::blobs}) {
      SCOPED_TRACE(describe(relief, gaps, 75, 60, 21));
      const auto owned = make_window<float>(relief, gaps, 75, 60, 21);
      OwnedWindow<double> wide{75, 60, {}};
      for (const float z : owned.heights) wide.heights.push_back(static_cast<double>(z) * 1.1);
      const auto all_paths = [&](const auto& input) {
        const double bound = bound_for(relief);
        const GridSides sides = settle_sides(input.window(), bound);
        const auto expected = tin::select_samples_with(input.window(), sides, bound,
                                                       terrace::base::SimdPath::portable);
        for (const terrace::base::SimdPath set :
             {terrace::base::SimdPath::avx2, terrace::base::SimdPath::avx512}) {
          if (!terrace::base::supports(set)) continue;
          EXPECT_EQ(tin::select_samples_with(input.window(), sides, bound, set), expected);
        }
      };
      all_paths(owned);
      all_paths(wide);
    }
  }
}

TEST(SelectSamples, RejectsInvalidArguments) {
  const auto owned = make_window<float>(Relief::hills, Gaps::none, 10, 8, 1);
  const GridSides sides = settle_sides(owned.window(), 1);
  const auto refused = [&](const GridWindow<float>& window, const GridSides& with, double bound) {
    EXPECT_THROW(select_samples(window, with, bound), std::invalid_argument);
  };
  refused({10, 9, owned.heights}, sides, 1);
  for (const double bad : {-1.0, std::nan(""), 1e200}) refused(owned.window(), sides, bad);
  GridSides wrong = sides;
  wrong.last_column = {0, 3};
  refused(owned.window(), wrong, 1);
}

}  // namespace
