// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "terrace/cluster/block.hpp"

/// The inner loops of linkage. Private to linkage. All instruction sets give the same bytes.

namespace terrace::cluster {

/// Integers as wide as the entries, so that vectors can hold either.
template <class T>
using LaneIndex = std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t>;

template <class T>
struct LinkageKernels {
  /// Sets out[k] to the squared distance of (px, py, pz) and (x[k], y[k], z[k]), rounded once to T.
  void (*distances)(const double* x, const double* y, const double* z, std::size_t count, double px,
                    double py, double pz, T* out);
  /// Where v[k] < best[k], sets best[k] = v[k] and best_row[k] = row. Returns the first position of
  /// the least v and stores that v in `least`. Returns count if no v is below the given `least`.
  std::size_t (*minima)(const T* v, std::size_t count, LaneIndex<T> row, T* best,
                        LaneIndex<T>* best_row, T* least);
  /// Sets to[k] = max(to[k], from[k]).
  void (*raise)(T* to, const T* from, std::size_t count);
  /// Sets out[k] = max(from[first[k]], from[second[k]]).
  void (*pick)(const T* from, const std::uint32_t* first, const std::uint32_t* second,
               std::size_t count, T* out);
  /// Returns the number of k < count for which first[k] is one of the `length` numbers after a,
  /// modulo m, and second[k] is not. All numbers are below m.
  std::uint32_t (*straddling)(const std::uint32_t* first, const std::uint32_t* second,
                              std::size_t count, std::uint32_t a, std::uint32_t length,
                              std::uint32_t m);
};

extern const LinkageKernels<float> kLinkageFloatPortable, kLinkageFloatAvx2, kLinkageFloatAvx512;
extern const LinkageKernels<double> kLinkageDoublePortable, kLinkageDoubleAvx2,
    kLinkageDoubleAvx512;

/// Throws std::invalid_argument if the processor lacks the instructions of the path.
template <class T>
const LinkageKernels<T>& linkage_kernels(SimdPath path);

}  // namespace terrace::cluster
