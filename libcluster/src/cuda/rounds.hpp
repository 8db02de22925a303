// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "cuda/device_primitives.hpp"
#include "terrace/cluster/point.hpp"

/// The interface of the GPU code for plain C++. Exists only in builds with CUDA.

namespace terrace::cluster::device {

/// Returns why there is no usable device, or an empty string if there is one.
[[nodiscard]] std::string cuda_fault();
[[nodiscard]] std::string cuda_device_name();

/// See device_complete.hpp and device_single.hpp. Entry: float or double.
template <class Entry>
[[nodiscard]] std::vector<RoundLink> cuda_complete_rounds(std::span<const Point3> points);
[[nodiscard]] std::vector<RoundLink> cuda_single_rounds(std::span<const Point3> points);

}  // namespace terrace::cluster::device
