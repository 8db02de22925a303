// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/linkage.hpp"

#include <stdexcept>

#include "linkage/points.hpp"

#ifdef TERRACE_CLUSTER_CUDA
#include "cuda/device_dendrogram.hpp"
#include "cuda/rounds.hpp"
#endif

namespace terrace::cluster {
namespace {

/// Checks points before the device, so that invalid points give the same error on every machine.
LinkagePoints checked(std::span<const Point3> points) {
  LinkagePoints scaled(points);
  if (const CudaStatus status = cuda_available(); !status.available) {
    throw std::runtime_error(status.reason);
  }
  return scaled;
}

}  // namespace

#ifdef TERRACE_CLUSTER_CUDA

CudaStatus cuda_available() {
  const std::string fault = device::cuda_fault();
  if (fault.empty()) return {true, device::cuda_device_name(), {}};
  return {false,
          {},
          "this machine has no usable CUDA device (" + fault +
              "): cluster on the CPU, or check the GPU and its driver"};
}

Dendrogram cuda_complete_linkage(std::span<const Point3> points, MatrixEntry entry) {
  return device::dendrogram_of(checked(points), [&](std::span<const Point3> ordered) {
    return entry == MatrixEntry::float32 ? device::cuda_complete_rounds<float>(ordered)
                                         : device::cuda_complete_rounds<double>(ordered);
  });
}

Dendrogram cuda_single_linkage(std::span<const Point3> points) {
  return device::dendrogram_of(checked(points), [](std::span<const Point3> ordered) {
    return device::cuda_single_rounds(ordered);
  });
}

#else

CudaStatus cuda_available() {
  return {false,
          {},
          "this build has no CUDA support: cluster on the CPU, or build with nvcc in PATH and the "
          "option -Dterrace_cuda=enabled"};
}

// checked() throws, because there is no device.
Dendrogram cuda_complete_linkage(std::span<const Point3> points, MatrixEntry) {
  (void)checked(points);
  return {};
}

Dendrogram cuda_single_linkage(std::span<const Point3> points) {
  (void)checked(points);
  return {};
}

#endif

}  // namespace terrace::cluster
