// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "point_tin_oracle.hpp"
#include "terrace/tri/point_tin.hpp"

namespace terrace::tri {
namespace {

using namespace point_tin_oracle;

/// Compares every sample with the chain, by brute force.
double line_error(const std::vector<double>& t, const std::vector<double>& z,
                  const SimplifiedLine& line) {
  double worst = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (i > 0 && t[i] == t[i - 1]) continue;
    double height = t[i] <= line.vertices.front().t ? line.vertices.front().height
                                                    : line.vertices.back().height;
    for (std::size_t k = 1; k < line.vertices.size(); ++k) {
      const LineVertex& a = line.vertices[k - 1];
      const LineVertex& b = line.vertices[k];
      if (t[i] >= a.t && t[i] <= b.t)
        height = (a.height * (b.t - t[i]) + b.height * (t[i] - a.t)) / (b.t - a.t);
    }
    worst = std::max(worst, std::abs(height - z[i]));
  }
  return worst;
}

TEST(SimplifyLine, KeepsTheError) {
  for (const std::uint64_t seed : {21u, 22u, 23u}) {
    for (const bool on_lattice : {false, true}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + (on_lattice ? ", lattice" : ""));
      std::mt19937_64 random(seed);
      std::vector<double> t;
      std::vector<double> z;
      for (std::size_t i = 0; i < 1500; ++i) t.push_back(2000 * to_unit(random()));
      std::sort(t.begin(), t.end());
      for (std::size_t i = 7; i < t.size(); i += 100) t[i] = t[i - 1];
      for (const double u : t) z.push_back(rough(u / 2000, 0.3));
      std::size_t before = t.size() + 1;
      for (const double error : {0.0, 0.05, 1.0, 10.0, 1000.0}) {
        std::optional<TinLattice> lattice;
        if (on_lattice) lattice = TinLattice{1, 0.25};
        const SimplifiedLine line = simplify_line(t, z, error, lattice);
        EXPECT_NEAR(line_error(t, z, line), line.largest_error, 1e-10);
        if (!on_lattice || error >= 10) {
          EXPECT_LE(line.largest_error, error);
        }
        EXPECT_LE(line.vertices.size(), before);
        before = line.vertices.size();
        EXPECT_EQ(line.vertices.front().sample, 0u);
        for (std::size_t k = 0; k < line.vertices.size(); ++k) {
          const LineVertex& v = line.vertices[k];
          if (k > 0) {
            EXPECT_GT(v.t, line.vertices[k - 1].t);
          }
          if (on_lattice) {
            EXPECT_EQ(v.t, std::floor(t[v.sample] + 0.5));
            EXPECT_EQ(v.height * 4, std::floor(v.height * 4));
          } else {
            EXPECT_EQ(v.t, t[v.sample]);
            EXPECT_EQ(v.height, z[v.sample]);
          }
        }
      }
      EXPECT_EQ(before, 2u);
    }
  }
}

TEST(SimplifyLine, HandlesFewAndBadSamples) {
  EXPECT_TRUE(simplify_line({}, {}, 1).vertices.empty());
  const std::vector<double> t{1, 1, 1};
  const std::vector<double> z{5, 6, 7};
  const SimplifiedLine one = simplify_line(t, z, 0);
  ASSERT_EQ(one.vertices.size(), 1u);
  EXPECT_EQ(one.vertices[0].height, 5);
  EXPECT_EQ(one.largest_error, 0);
  const std::vector<double> close{0.1, 0.2, 0.3};
  const SimplifiedLine rounded = simplify_line(close, z, 0, TinLattice{0, 1});
  ASSERT_EQ(rounded.vertices.size(), 1u);
  EXPECT_EQ(rounded.largest_error, 2);
  const std::vector<double> down{1, 3, 2};
  EXPECT_NE(refused([&] { (void)simplify_line(down, z, 1); }).find("sample 2"), std::string::npos);
  const std::vector<double> nan{1, 2, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_NE(refused([&] { (void)simplify_line(t, nan, 1); }).find("sample 2"), std::string::npos);
  EXPECT_NE(refused([&] { (void)simplify_line(t, z, -1); }), "accepted");
  EXPECT_NE(refused([&] { (void)simplify_line(t, {}, 1); }), "accepted");
  EXPECT_NE(refused([&] { (void)simplify_line(t, z, 1, TinLattice{0, -1}); }), "accepted");
}

}  // namespace
}  // namespace terrace::tri
