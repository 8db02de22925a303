// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <random>
#include <vector>

#include "cuda/device_primitives.hpp"

namespace terrace::cluster {

/// A device for kernels (see src/cuda/device_primitives.hpp) that loops over their indices, in an
/// order drawn for each kernel, so that any dependence on the order of threads gives different
/// results. Memory starts with garbage.
class LoopDevice {
 public:
  /// lanes: threads per group. Without shuffling the order is ascending.
  LoopDevice(std::uint32_t lanes, bool shuffle, std::uint64_t seed)
      : lanes_(lanes), shuffle_(shuffle), random_(seed) {}

  template <class T>
  class Memory {
   public:
    Memory() = default;
    explicit Memory(std::size_t count) : values_(count) {
      std::memset(static_cast<void*>(values_.data()), 0xA5, count * sizeof(T));
    }
    [[nodiscard]] T* data() { return values_.data(); }
    [[nodiscard]] std::size_t size() const { return values_.size(); }

   private:
    std::vector<T> values_;
  };

  template <class T>
  Memory<T> allocate(std::size_t count) {
    bytes += count * sizeof(T);
    return Memory<T>(count);
  }
  template <class T>
  void upload(T* to, const T* from, std::size_t count) {
    std::copy_n(from, count, to);
  }
  template <class T>
  void download(T* to, const T* from, std::size_t count) {
    std::copy_n(from, count, to);
  }
  template <class T>
  void clear(T* values, std::size_t count) {
    std::memset(static_cast<void*>(values), 0, count * sizeof(T));
  }
  void wait() {}

  template <class Kernel>
  void each(std::size_t count, const Kernel& kernel) {
    ++launches;
    for (const std::size_t index : order(count)) kernel(index);
  }
  template <class Kernel>
  void lanes(std::uint32_t groups, const Kernel& kernel) {
    ++launches;
    // Mixes the lanes of all groups.
    for (const std::size_t index : order(std::size_t{groups} * lanes_)) {
      const auto group = static_cast<std::uint32_t>(index / lanes_);
      if (!kernel.skip(group)) {
        kernel(group, static_cast<std::uint32_t>(index % lanes_), lanes_);
      }
    }
  }
  template <class Kernel>
  void reduce(std::uint32_t groups, const Kernel& kernel) {
    ++launches;
    for (const std::size_t index : order(groups)) {
      const auto group = static_cast<std::uint32_t>(index);
      if (kernel.skip(group)) continue;
      auto best = kernel.part(group, 0, lanes_);
      for (const std::size_t lane : order(lanes_ - 1)) {
        best =
            device::nearer(kernel.part(group, static_cast<std::uint32_t>(lane + 1), lanes_), best);
      }
      kernel.finish(group, best);
    }
  }

  std::size_t bytes = 0;     ///< bytes allocated, whether released or not
  std::size_t launches = 0;  ///< number of kernels started

 private:
  std::vector<std::size_t> order(std::size_t count) {
    std::vector<std::size_t> indices(count);
    std::iota(indices.begin(), indices.end(), std::size_t{0});
    for (std::size_t i = count; shuffle_ && i > 1; --i) {
      std::swap(indices[i - 1], indices[random_() % i]);
    }
    return indices;
  }

  std::uint32_t lanes_;
  bool shuffle_;
  std::mt19937_64 random_;
};

}  // namespace terrace::cluster
