// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

#include <cuda_runtime.h>

#include "cuda/device_primitives.hpp"

namespace terrace::cluster::device {

inline void check_cuda(cudaError_t error, const char* what) {
  if (error == cudaSuccess) return;
  throw std::runtime_error(std::string("CUDA failed to ") + what + ": " +
                           cudaGetErrorString(error));
}

inline constexpr unsigned kThreads = 256;
inline constexpr unsigned kWarp = 32;

template <class Kernel>
__global__ void __launch_bounds__(kThreads) run_each(std::size_t count, Kernel kernel) {
  const std::size_t index = static_cast<std::size_t>(blockIdx.x) * kThreads + threadIdx.x;
  if (index < count) kernel(index);
}

template <class Kernel>
__global__ void __launch_bounds__(kThreads) run_lanes(Kernel kernel) {
  if (!kernel.skip(blockIdx.x)) kernel(blockIdx.x, threadIdx.x, kThreads);
}

template <class Entry>
__device__ Best<Entry> nearest_of_warp(Best<Entry> best) {
  for (unsigned step = kWarp / 2; step > 0; step /= 2) {
    Best<Entry> other;
    other.value = __shfl_down_sync(0xffffffffu, best.value, step);
    other.index = __shfl_down_sync(0xffffffffu, best.index, step);
    best = nearer(best, other);
  }
  return best;
}

template <class Entry, class Kernel>
__global__ void __launch_bounds__(kThreads) run_reduce(Kernel kernel) {
  // The same for all threads of the block, so that either all or none of them reach the barrier.
  if (kernel.skip(blockIdx.x)) return;
  __shared__ Entry value[kThreads / kWarp];
  __shared__ std::uint32_t index[kThreads / kWarp];
  const Best<Entry> of_warp = nearest_of_warp(kernel.part(blockIdx.x, threadIdx.x, kThreads));
  if (threadIdx.x % kWarp == 0) {
    value[threadIdx.x / kWarp] = of_warp.value;
    index[threadIdx.x / kWarp] = of_warp.index;
  }
  __syncthreads();
  if (threadIdx.x != 0) return;
  Best<Entry> best = of_warp;
  for (unsigned warp = 1; warp < kThreads / kWarp; ++warp) {
    best = nearer(best, Best<Entry>{value[warp], index[warp]});
  }
  kernel.finish(blockIdx.x, best);
}

/// The current GPU as a device for kernels (device_primitives.hpp). Kernels run one after another.
/// Only download() and wait() wait for them.
class CudaDevice {
 public:
  /// Owns memory on the GPU.
  template <class T>
  class Memory {
   public:
    Memory() = default;
    explicit Memory(std::size_t count) : size_(count) {
      check_cuda(cudaMalloc(reinterpret_cast<void**>(&data_), count * sizeof(T)),
                 "allocate memory on the device");
    }
    Memory(Memory&& other) noexcept
        : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
    Memory& operator=(Memory&& other) noexcept {
      std::swap(data_, other.data_);
      std::swap(size_, other.size_);
      return *this;
    }
    ~Memory() { cudaFree(data_); }
    [[nodiscard]] T* data() const { return data_; }
    [[nodiscard]] std::size_t size() const { return size_; }

   private:
    T* data_ = nullptr;
    std::size_t size_ = 0;
  };

  template <class T>
  Memory<T> allocate(std::size_t count) {
    return Memory<T>(count);
  }
  template <class T>
  void upload(T* to, const T* from, std::size_t count) {
    check_cuda(cudaMemcpy(to, from, count * sizeof(T), cudaMemcpyHostToDevice),
               "copy to the device");
  }
  template <class T>
  void download(T* to, const T* from, std::size_t count) {
    check_cuda(cudaMemcpy(to, from, count * sizeof(T), cudaMemcpyDeviceToHost),
               "run on the device or copy from it");
  }
  template <class T>
  void clear(T* values, std::size_t count) {
    check_cuda(cudaMemsetAsync(values, 0, count * sizeof(T)), "clear memory of the device");
  }
  void wait() { check_cuda(cudaDeviceSynchronize(), "run on the device"); }

  template <class Kernel>
  void each(std::size_t count, const Kernel& kernel) {
    run_each<<<static_cast<unsigned>((count + kThreads - 1) / kThreads), kThreads>>>(count, kernel);
    check_cuda(cudaGetLastError(), "start a kernel");
  }
  template <class Kernel>
  void lanes(std::uint32_t groups, const Kernel& kernel) {
    run_lanes<<<groups, kThreads>>>(kernel);
    check_cuda(cudaGetLastError(), "start a kernel");
  }
  template <class Kernel>
  void reduce(std::uint32_t groups, const Kernel& kernel) {
    using Entry = decltype(kernel.part(0, 0, 1).value);
    run_reduce<Entry><<<groups, kThreads>>>(kernel);
    check_cuda(cudaGetLastError(), "start a kernel");
  }
};

}  // namespace terrace::cluster::device
