// SPDX-License-Identifier: Apache-2.0
#include <cstdint>

#include "cuda/device.cuh"
#include "cuda/device_complete.hpp"
#include "cuda/device_single.hpp"
#include "cuda/rounds.hpp"

namespace terrace::cluster::device {
namespace {

/// Throws std::invalid_argument if the device has less free memory than `bytes`.
void check_memory(std::size_t points, std::uint64_t bytes, const char* remedy) {
  std::size_t left = 0;
  std::size_t all = 0;
  check_cuda(cudaMemGetInfo(&left, &all), "query its memory");
  if (bytes <= left) return;
  throw std::invalid_argument(std::to_string(points) + " points would need " +
                              std::to_string(bytes) + " bytes of memory on the device, which has " +
                              std::to_string(left) + " free; " + remedy);
}

}  // namespace

std::string cuda_fault() {
  int count = 0;
  cudaError_t error = cudaGetDeviceCount(&count);
  if (error == cudaSuccess && count == 0) error = cudaErrorNoDevice;
  // Tests whether the kernels of this file can run on the device.
  cudaFuncAttributes attributes;
  if (error == cudaSuccess) error = cudaFuncGetAttributes(&attributes, run_each<OwnClusters>);
  if (error == cudaSuccess) return {};
  (void)cudaGetLastError();
  return cudaGetErrorString(error);
}

std::string cuda_device_name() {
  int device = 0;
  cudaDeviceProp properties;
  check_cuda(cudaGetDevice(&device), "query its device");
  check_cuda(cudaGetDeviceProperties(&properties, device), "query its device");
  return properties.name;
}

template <class Entry>
std::vector<RoundLink> cuda_complete_rounds(std::span<const Point3> points) {
  check_memory(points.size(), complete_rounds_bytes<Entry>(points.size()),
               "use float entries or fewer points");
  CudaDevice device;
  return complete_rounds<Entry>(device, points);
}
template std::vector<RoundLink> cuda_complete_rounds<float>(std::span<const Point3>);
template std::vector<RoundLink> cuda_complete_rounds<double>(std::span<const Point3>);

std::vector<RoundLink> cuda_single_rounds(std::span<const Point3> points) {
  check_memory(points.size(), single_rounds_bytes(points.size()), "use fewer points");
  CudaDevice device;
  return single_rounds(device, points);
}

}  // namespace terrace::cluster::device
