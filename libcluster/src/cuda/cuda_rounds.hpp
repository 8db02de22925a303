// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "cuda/device_primitives.hpp"
#include "terrace/cluster/point.hpp"

/// The interface of the code compiled for the GPU, for plain C++. Only in builds with CUDA.

namespace terrace::cluster::device {

/// Why there is no usable device; empty if there is one.
[[nodiscard]] std::string cuda_fault();
[[nodiscard]] std::string cuda_device_name();

/// See device_complete.hpp, device_single.hpp. Entry: float or double.
template <class Entry>
[[nodiscard]] std::vector<RoundLink> cuda_complete_rounds(std::span<const Point3> points);
[[nodiscard]] std::vector<RoundLink> cuda_single_rounds(std::span<const Point3> points);

}  // namespace terrace::cluster::device
