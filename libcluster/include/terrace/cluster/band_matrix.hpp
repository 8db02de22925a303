// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "terrace/cluster/band_index.hpp"

/// Storage of a symmetric matrix of distances as a band (band_index.hpp).

namespace terrace::cluster {

/// Bytes of the entries of a band matrix. Throws std::invalid_argument, which says how many they
/// are, if they exceed `memory_limit` (0: no limit).
[[nodiscard]] std::uint64_t checked_band_bytes(std::size_t n, std::size_t bytes_per_entry,
                                               std::uint64_t memory_limit);

/// n * floor(n / 2) entries of type T, float or double; not initialised.
template <class T>
class BandMatrix {
 public:
  /// Throws std::invalid_argument if the entries do not fit the limit, see checked_band_bytes(),
  /// and std::bad_alloc.
  explicit BandMatrix(std::size_t n, std::uint64_t memory_limit = 0)
      : n_(n), data_(allocate(checked_band_bytes(n, sizeof(T), memory_limit))) {}

  [[nodiscard]] std::size_t size() const { return n_; }
  [[nodiscard]] std::size_t width() const { return n_ / 2; }
  /// The width() entries (i, i + 1), (i, i + 2), .. with columns modulo n.
  [[nodiscard]] T* row(std::size_t i) { return data_.get() + i * width(); }
  [[nodiscard]] const T* row(std::size_t i) const { return data_.get() + i * width(); }
  [[nodiscard]] T at(std::size_t i, std::size_t j) const {
    assert(i < n_ && j < n_ && i != j);
    return data_[band_entry(n_, i, j)];
  }
  /// Sets the pair, both copies if there are two.
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
