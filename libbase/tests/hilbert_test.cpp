// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/hilbert.hpp>

namespace terrace::base {
namespace {

/// The laws of the curve: it visits every cell once, and each step is to a neighbour.
template <std::size_t D, unsigned Bits>
void check_curve() {
  constexpr std::size_t kCells = std::size_t{1} << (D * Bits);
  std::vector<std::array<std::uint32_t, D>> cells(kCells);
  std::vector<bool> visited(kCells);
  for (std::uint32_t i = 0; i < kCells; ++i) {
    std::array<std::uint32_t, D> cell{};
    for (unsigned axis = 0; axis < D; ++axis) cell[axis] = i >> (axis * Bits) & ((1u << Bits) - 1);
    const std::uint64_t index =
        std::apply([](auto... c) { return hilbert_index<Bits>(c...); }, cell);
    ASSERT_LT(index, kCells);
    ASSERT_FALSE(visited[index]);
    visited[index] = true;
    cells[index] = cell;
  }
  EXPECT_EQ((cells[0]), (std::array<std::uint32_t, D>{}));
  for (std::size_t i = 1; i < kCells; ++i) {
    std::uint32_t steps = 0;
    for (std::size_t axis = 0; axis < D; ++axis) {
      steps += cells[i][axis] > cells[i - 1][axis] ? cells[i][axis] - cells[i - 1][axis]
                                                   : cells[i - 1][axis] - cells[i][axis];
    }
    ASSERT_EQ(steps, 1u) << "step " << i << " in " << D << " dimensions";
  }
}

TEST(Hilbert, StepsToNeighbours) {
  check_curve<2, 4>();
  check_curve<2, 8>();
  check_curve<3, 1>();
  check_curve<3, 3>();
  check_curve<3, 5>();
}

/// In the plane: the curve of J. Skilling, Programming the Hilbert curve, 2004, which is computed
/// from the finest bit without a table.
std::uint64_t skilling_index(std::array<std::uint32_t, 2> cell, unsigned bits) {
  for (std::uint32_t bit = std::uint32_t{1} << (bits - 1); bit > 1; bit >>= 1) {
    const std::uint32_t below = bit - 1;
    for (std::uint32_t& x : cell) {
      if ((x & bit) != 0) {
        cell[0] ^= below;
      } else {
        const std::uint32_t exchanged = (cell[0] ^ x) & below;
        cell[0] ^= exchanged;
        x ^= exchanged;
      }
    }
  }
  cell[1] ^= cell[0];
  std::uint32_t flipped = 0;
  for (std::uint32_t bit = std::uint32_t{1} << (bits - 1); bit > 1; bit >>= 1) {
    if ((cell[1] & bit) != 0) flipped ^= bit - 1;
  }
  std::uint64_t index = 0;
  for (unsigned bit = bits; bit-- > 0;) {
    for (const std::uint32_t x : cell) index = index << 1 | (((x ^ flipped) >> bit) & 1);
  }
  return index;
}

TEST(Hilbert, AgreesWithSkillingInThePlane) {
  std::uint64_t state = 5;
  for (int round = 0; round < 20000; ++round) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    const auto x = static_cast<std::uint32_t>(state >> 32), y = static_cast<std::uint32_t>(state);
    EXPECT_EQ(hilbert_index<32>(x, y), skilling_index({x, y}, 32));
    EXPECT_EQ(hilbert_index<16>(x >> 16, y >> 16), skilling_index({x >> 16, y >> 16}, 16));
  }
}

/// The first bits of an index are the index of the coarse cell, so cells of any size are runs of
/// the curve.
TEST(Hilbert, CoarseCellsAreRunsOfTheCurve) {
  std::uint64_t state = 9;
  for (int round = 0; round < 20000; ++round) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    const std::array<std::uint32_t, 3> cell{static_cast<std::uint32_t>(state >> 43),
                                            static_cast<std::uint32_t>(state >> 22 & 0x1FFFFF),
                                            static_cast<std::uint32_t>(state & 0x1FFFFF)};
    EXPECT_EQ(hilbert_index<21>(cell[0], cell[1], cell[2]) >> 33,
              hilbert_index<10>(cell[0] >> 11, cell[1] >> 11, cell[2] >> 11));
  }
}

}  // namespace
}  // namespace terrace::base
