// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <terrace/base/simd.hpp>

namespace terrace::matching {

/// The type in which costs are added: double for double and float, 64-bit integers for 32-bit
/// integers.
template <class Cost>
using CostSum = std::conditional_t<std::is_integral_v<Cost>, std::int64_t, double>;

/// Larger than every distance, and used where there is none.
template <class Sum>
inline constexpr Sum kUnreachable = std::numeric_limits<Sum>::infinity();
template <>
inline constexpr std::int64_t kUnreachable<std::int64_t> = std::int64_t{1} << 61;
/// The label that keeps a settled column settled: base + c - kSettled is at least kUnreachable for
/// any cost c.
template <class Sum>
inline constexpr Sum kSettled = -std::numeric_limits<Sum>::infinity();
template <>
inline constexpr std::int64_t kSettled<std::int64_t> = -(std::int64_t{1} << 62);

/// Number of columns that share one entry of `block_least`.
inline constexpr std::size_t kScanBlock = 128;

/// The inner loops over a row of the matrix, compiled for each instruction set. All versions give
/// the same numbers.
template <class Cost>
struct ScanKernels {
  using Sum = CostSum<Cost>;
  /// For each column j computes through = (base + costs[j]) - labels[j]. Where that is below
  /// distance[j], stores it in distance[j] and `row` in previous[j]. Writes the least distance of
  /// each block of columns to block_least, and returns the least of all.
  Sum (*relax)(const Cost* costs, const Sum* labels, std::size_t columns, Sum base,
               std::int64_t row, Sum* distance, std::int64_t* previous, Sum* block_least);
  /// Computes the two least values of costs[j] - labels[j]. They are equal if two columns tie. A
  /// missing value is kUnreachable.
  void (*least_two)(const Cost* costs, const Sum* labels, std::size_t columns, Sum* first,
                    Sum* second);
};

/// Returns the kernels for the best instruction set of this processor.
template <class Cost>
const ScanKernels<Cost>& scan_kernels();

/// Returns the kernels for a supported instruction set. Tests compare them with each other.
template <class Cost>
const ScanKernels<Cost>& scan_kernels(base::SimdPath path);

}  // namespace terrace::matching
