// SPDX-License-Identifier: Apache-2.0
#include "assignment/scan_kernels.hpp"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/simd.hpp>

namespace terrace::matching {
namespace {

template <class Cost>
class ScanKernelsTyped : public testing::Test {};
using CostTypes = testing::Types<double, float, std::int32_t>;
TYPED_TEST_SUITE(ScanKernelsTyped, CostTypes);

// Compares each instruction set with the definition, column by column.
TYPED_TEST(ScanKernelsTyped, MatchTheDefinitionOnEveryInstructionSet) {
  using Sum = CostSum<TypeParam>;
  for (const base::SimdPath path :
       {base::SimdPath::portable, base::SimdPath::avx2, base::SimdPath::avx512}) {
    if (!base::supports(path)) continue;
    const ScanKernels<TypeParam>& kernels = scan_kernels<TypeParam>(path);
    for (std::size_t columns = 1; columns <= 400; columns += 1 + columns / 9) {
      SCOPED_TRACE(testing::Message() << "path " << static_cast<int>(path) << ", " << columns);
      std::mt19937_64 random(columns);
      std::vector<TypeParam> costs(columns);
      std::vector<Sum> labels(columns), distance(columns);
      for (std::size_t j = 0; j < columns; ++j) {
        costs[j] = static_cast<TypeParam>(static_cast<int>(random() % 100) - 20);
        labels[j] = random() % 5 == 0 ? kSettled<Sum> : -static_cast<Sum>(random() % 50);
        distance[j] = random() % 3 == 0 ? kUnreachable<Sum> : static_cast<Sum>(random() % 100);
      }
      std::vector<std::int64_t> previous(columns, 3), expected_previous = previous;
      std::vector<Sum> expected = distance;
      for (std::size_t j = 0; j < columns; ++j) {
        const Sum through = 7 + static_cast<Sum>(costs[j]) - labels[j];
        if (through < expected[j]) {
          expected[j] = through;
          expected_previous[j] = 5;
        }
      }
      std::vector<Sum> block_least((columns + kScanBlock - 1) / kScanBlock);
      const Sum least = kernels.relax(costs.data(), labels.data(), columns, 7, 5, distance.data(),
                                      previous.data(), block_least.data());
      EXPECT_EQ(distance, expected);
      EXPECT_EQ(previous, expected_previous);
      EXPECT_EQ(least, *std::min_element(expected.begin(), expected.end()));
      for (std::size_t b = 0; b < block_least.size(); ++b) {
        const auto begin = expected.begin() + static_cast<std::ptrdiff_t>(b * kScanBlock);
        const auto end = std::min(expected.end() - begin, std::ptrdiff_t{kScanBlock});
        EXPECT_EQ(block_least[b], *std::min_element(begin, begin + end));
      }
      for (Sum& label : labels) label = std::max<Sum>(label, -50);
      std::vector<Sum> reduced(columns + 1, kUnreachable<Sum>);
      for (std::size_t j = 0; j < columns; ++j) reduced[j] = static_cast<Sum>(costs[j]) - labels[j];
      std::sort(reduced.begin(), reduced.end());
      Sum first, second;
      kernels.least_two(costs.data(), labels.data(), columns, &first, &second);
      EXPECT_EQ(first, reduced[0]);
      EXPECT_EQ(second, reduced[1]);
    }
  }
}

// The other tests silently skip instruction sets that the machine lacks. These two report it.
TEST(InstructionSets, Avx2IsTested) {
  if (!base::supports(base::SimdPath::avx2)) GTEST_SKIP() << "the processor lacks AVX2";
}

TEST(InstructionSets, Avx512IsTested) {
  if (!base::supports(base::SimdPath::avx512)) GTEST_SKIP() << "the processor lacks AVX-512";
}

}  // namespace
}  // namespace terrace::matching
