// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// Places in the band-shaped half of a symmetric n x n matrix without its diagonal: row i holds the
/// floor(n / 2) entries (i, i+1), (i, i+2), .. with columns modulo n. Rows are equally long, so
/// equal shares of rows are equal shares of work. For odd n each pair is there once; for even n the
/// n / 2 pairs {i, i + n/2} are there twice, in row i and in row i + n/2.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 7.6.2. Its (7.10) as printed
/// is no inverse of (7.9); band_place() is. Compiles as CUDA, for host and device.

#ifdef __CUDACC__
#define TERRACE_CLUSTER_HOST_DEVICE __host__ __device__
#else
#define TERRACE_CLUSTER_HOST_DEVICE
#endif

namespace terrace::cluster {

/// A place in the band: row < n, column < floor(n / 2).
struct BandPlace {
  std::uint64_t row, column;
};

/// Entries of each row.
TERRACE_CLUSTER_HOST_DEVICE inline constexpr std::uint64_t band_width(std::uint64_t n) {
  return n / 2;
}

/// The column of the square matrix that an entry of the band belongs to; its row is place.row.
TERRACE_CLUSTER_HOST_DEVICE inline constexpr std::uint64_t band_partner(std::uint64_t n,
                                                                        BandPlace place) {
  const std::uint64_t j = place.row + place.column + 1;
  return j < n ? j : j - n;
}

/// Where the pair {i, j} is, i != j, both below n. If it is there twice: in row i.
TERRACE_CLUSTER_HOST_DEVICE inline constexpr BandPlace band_place(std::uint64_t n, std::uint64_t i,
                                                                  std::uint64_t j) {
  const std::uint64_t ahead = j > i ? j - i : j + n - i;  // (j - i) mod n
  return ahead > n / 2 ? BandPlace{j, n - ahead - 1} : BandPlace{i, ahead - 1};
}

/// The number of that entry, counted row by row.
TERRACE_CLUSTER_HOST_DEVICE inline constexpr std::uint64_t band_entry(std::uint64_t n,
                                                                      std::uint64_t i,
                                                                      std::uint64_t j) {
  const BandPlace place = band_place(n, i, j);
  return place.row * band_width(n) + place.column;
}

}  // namespace terrace::cluster
