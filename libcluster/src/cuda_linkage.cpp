// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/cuda_linkage.hpp"

#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "linkage_points.hpp"

#ifdef TERRACE_CLUSTER_CUDA
#include "cuda_rounds.hpp"
#include "linkage_tree.hpp"
#endif

namespace terrace::cluster {
namespace {

#ifdef TERRACE_CLUSTER_CUDA

template <class Rounds>
Dendrogram linkage(std::span<const Point3> points, const Rounds& rounds) {
  const LinkagePoints scaled(points);
  if (const CudaStatus status = cuda_available(); !status.available) {
    throw std::runtime_error(status.reason);
  }
  if (points.size() < 2) return make_dendrogram(points.size(), {});
  // In the order of a kD-tree most clusters that merge have rows that are near in the matrix.
  std::vector<std::uint32_t> all(points.size());
  std::iota(all.begin(), all.end(), 0u);
  const LinkageTree tree(scaled.scaled(), all, 1);
  std::vector<Point3> ordered(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) ordered[i] = tree.point(i);
  std::vector<Link> links;
  links.reserve(points.size());
  for (const device::RoundLink& link : rounds(ordered)) {
    links.push_back({tree.number(link.i), tree.number(link.j), scaled.height(link.square)});
  }
  return make_dendrogram(points.size(), links);
}

#else

Dendrogram refuse(std::span<const Point3> points) {
  const LinkagePoints scaled(points);
  throw std::runtime_error(cuda_available().reason);
}

#endif

}  // namespace

#ifdef TERRACE_CLUSTER_CUDA

CudaStatus cuda_available() {
  const std::string fault = device::cuda_fault();
  if (!fault.empty()) {
    return {false,
            {},
            "this machine has no CUDA device that works (" + fault +
                "): cluster on the CPU, or see to the GPU and its driver"};
  }
  return {true, device::cuda_device_name(), {}};
}

Dendrogram cuda_complete_linkage(std::span<const Point3> points,
                                 const CudaLinkageOptions& options) {
  return linkage(points, [&](const std::vector<Point3>& scaled) {
    return options.entry == MatrixEntry::float32 ? device::cuda_complete_rounds<float>(scaled)
                                                 : device::cuda_complete_rounds<double>(scaled);
  });
}

Dendrogram cuda_single_linkage(std::span<const Point3> points) {
  return linkage(
      points, [](const std::vector<Point3>& scaled) { return device::cuda_single_rounds(scaled); });
}

#else

CudaStatus cuda_available() {
  return {false,
          {},
          "this build is without CUDA: cluster on the CPU, or build with nvcc in PATH and the "
          "option -Dterrace_cuda=enabled"};
}

Dendrogram cuda_complete_linkage(std::span<const Point3> points, const CudaLinkageOptions&) {
  return refuse(points);
}

Dendrogram cuda_single_linkage(std::span<const Point3> points) { return refuse(points); }

#endif

}  // namespace terrace::cluster
