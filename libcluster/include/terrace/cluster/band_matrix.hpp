// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>

/// Marks functions that also compile as CUDA device code. Used by the CUDA sources too.
#ifdef __CUDACC__
#define TERRACE_CLUSTER_HOST_DEVICE __host__ __device__
#else
#define TERRACE_CLUSTER_HOST_DEVICE
#endif

/// The band-shaped half of a symmetric n x n matrix without its diagonal. Row i holds the n / 2
/// entries (rounded down) (i, i+1), (i, i+2), ... with columns modulo n. All rows have the same
/// length, so equal shares of rows are equal shares of work. For odd n each pair occurs once. For
/// even n the n / 2 pairs {i, i + n/2} occur twice, in row i and in row i + n/2. The free
/// functions also compile as CUDA device code.
/// Source: J. Skála, Algorithms for manipulating large geometric data, 7.6.2. Equation 7.10 as
/// printed does not invert 7.9, so band_place() corrects it.

namespace terrace::cluster {

/// A position in the band: row < n, column < floor(n / 2).
struct BandPlace {
  std::uint64_t row, column;
};

/// Returns the number of entries per row.
TERRACE_CLUSTER_HOST_DEVICE inline constexpr std::uint64_t band_width(std::uint64_t n) {
  return n / 2;
}

/// Returns the column of the square matrix to which an entry of the band belongs. Its row is
/// place.row.
TERRACE_CLUSTER_HOST_DEVICE inline constexpr std::uint64_t band_partner(std::uint64_t n,
                                                                        BandPlace place) {
  const std::uint64_t j = place.row + place.column + 1;
  return j < n ? j : j - n;
}

/// Returns the position of the pair {i, j}. If it occurs twice, returns that in row i. Requires
/// i != j, i < n and j < n.
TERRACE_CLUSTER_HOST_DEVICE inline constexpr BandPlace band_place(std::uint64_t n, std::uint64_t i,
                                                                  std::uint64_t j) {
  const std::uint64_t offset = j > i ? j - i : j + n - i;  // (j - i) mod n
  return offset > n / 2 ? BandPlace{j, n - offset - 1} : BandPlace{i, offset - 1};
}

/// Returns the index of the entry at band_place(n, i, j), counted row by row.
TERRACE_CLUSTER_HOST_DEVICE inline constexpr std::uint64_t band_entry(std::uint64_t n,
                                                                      std::uint64_t i,
                                                                      std::uint64_t j) {
  const BandPlace place = band_place(n, i, j);
  return place.row * band_width(n) + place.column;
}

/// Returns the size of a band matrix's entries in bytes. Throws: std::invalid_argument, with the
/// number of bytes, if it exceeds `memory_limit` (0: no limit).
[[nodiscard]] std::uint64_t checked_band_bytes(std::size_t n, std::size_t bytes_per_entry,
                                               std::uint64_t memory_limit);

/// A matrix of n * floor(n / 2) uninitialised entries of type T, float or double.
template <class T>
class BandMatrix {
 public:
  /// Throws: std::invalid_argument if the entries exceed the limit, see checked_band_bytes(), and
  /// std::bad_alloc.
  explicit BandMatrix(std::size_t n, std::uint64_t memory_limit = 0)
      : n_(n), data_(allocate(checked_band_bytes(n, sizeof(T), memory_limit))) {}

  [[nodiscard]] std::size_t size() const { return n_; }
  [[nodiscard]] std::size_t width() const { return n_ / 2; }
  /// Returns the width() entries (i, i + 1), (i, i + 2), ... with columns modulo n.
  [[nodiscard]] T* row(std::size_t i) { return data_.get() + i * width(); }
  [[nodiscard]] const T* row(std::size_t i) const { return data_.get() + i * width(); }
  /// Returns the entry of a pair. Requires i != j.
  [[nodiscard]] T at(std::size_t i, std::size_t j) const {
    assert(i < n_ && j < n_ && i != j);
    return data_[band_entry(n_, i, j)];
  }
  /// Sets the entry of a pair, or both copies if there are two.
  void set(std::size_t i, std::size_t j, T value) {
    assert(i < n_ && j < n_ && i != j);
    data_[band_entry(n_, i, j)] = value;
    data_[band_entry(n_, j, i)] = value;
  }

 private:
  struct Free {
    void operator()(T* data) const { release(data); }
  };
  static T* allocate(std::uint64_t bytes);
  static void release(T* data);

  std::size_t n_;
  std::unique_ptr<T[], Free> data_;
};

extern template class BandMatrix<float>;
extern template class BandMatrix<double>;

}  // namespace terrace::cluster
