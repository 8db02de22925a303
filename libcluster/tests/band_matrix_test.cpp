// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/band_matrix.hpp"

#include <limits>
#include <set>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

namespace terrace::cluster {
namespace {

TEST(BandIndex, HoldsEveryPairOnceOrTwice) {
  for (std::uint64_t n = 2; n <= 65; ++n) {
    SCOPED_TRACE(testing::Message() << "n = " << n);
    std::set<std::uint64_t> used;
    for (std::uint64_t i = 0; i < n; ++i) {
      for (std::uint64_t j = 0; j < n; ++j) {
        if (i == j) continue;
        const BandPlace place = band_place(n, i, j);
        ASSERT_LT(place.row, n);
        ASSERT_LT(place.column, n / 2);
        const std::uint64_t partner = band_partner(n, place);
        ASSERT_TRUE((place.row == i && partner == j) || (place.row == j && partner == i));
        ASSERT_EQ(band_entry(n, i, j), place.row * (n / 2) + place.column);
        used.insert(band_entry(n, i, j));
        const bool twice = n % 2 == 0 && (i + n / 2) % n == j;
        ASSERT_EQ(band_entry(n, i, j) != band_entry(n, j, i), twice);
      }
    }
    ASSERT_EQ(used.size(), n * (n / 2));
    // The thesis's mapping from a place to a pair (7.9) must invert it.
    for (std::uint64_t row = 0; row < n; ++row) {
      for (std::uint64_t column = 0; column < n / 2; ++column) {
        const std::uint64_t j = (column + row + 1) % n;
        ASSERT_EQ(band_partner(n, {row, column}), j);
        const BandPlace back = band_place(n, row, j);
        ASSERT_EQ(back.row, row);
        ASSERT_EQ(back.column, column);
      }
    }
  }
}

TEST(BandIndex, IsConstantExpression) {
  static_assert(band_width(7) == 3);
  static_assert(band_place(7, 6, 1).row == 6 && band_place(7, 6, 1).column == 1);
  static_assert(band_place(7, 1, 6).row == 6);
  static_assert(band_entry(std::uint64_t{1} << 31, 0, 1) == 0);
}

TEST(BandMatrix, SetsBothCopies) {
  for (std::size_t n = 1; n <= 20; ++n) {
    BandMatrix<double> matrix(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < i; ++j) matrix.set(i, j, static_cast<double>(100 * i + j));
    }
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        ASSERT_EQ(matrix.at(i, j), static_cast<double>(100 * i + j));
        ASSERT_EQ(matrix.at(j, i), static_cast<double>(100 * i + j));
      }
      for (std::size_t k = 0; k < matrix.width(); ++k) {
        ASSERT_EQ(matrix.row(i)[k], matrix.at(i, (i + k + 1) % n));
      }
    }
  }
}

TEST(BandMatrix, ReportsTheMemoryItNeeds) {
  EXPECT_EQ(checked_band_bytes(10000, 4, 0), 200000000u);
  EXPECT_EQ(checked_band_bytes(10000, 8, 400000000), 400000000u);
  EXPECT_EQ(checked_band_bytes(0, 8, 0), 0u);
  EXPECT_EQ(checked_band_bytes(1, 8, 0), 0u);
  const auto error = [](std::size_t n, std::size_t entry, std::uint64_t limit) -> std::string {
    try {
      (void)checked_band_bytes(n, entry, limit);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "no exception";
  };
  EXPECT_NE(error(10000, 8, 399999999).find("400000000 bytes"), std::string::npos);
  // Half of 10^14 entries. Without a limit the system must refuse them.
  EXPECT_NE(error(10000000, 8, std::uint64_t{1} << 40).find("400000000000000 bytes"),
            std::string::npos);
  EXPECT_EQ(checked_band_bytes(10000000, 8, 0), 400000000000000u);
  EXPECT_NE(error((std::size_t{1} << 31) - 1, 8, 0).find("18446744047939747848"),
            std::string::npos);
  EXPECT_NE(error(std::size_t{1} << 31, 8, 0).find("2^31"), std::string::npos);
  EXPECT_NE(error(std::numeric_limits<std::size_t>::max(), 8, 0).find("2^31"), std::string::npos);
}

}  // namespace
}  // namespace terrace::cluster
