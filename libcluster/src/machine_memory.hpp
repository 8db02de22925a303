// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace terrace::cluster {

/// Physical memory in bytes; the largest number where the system does not tell.
[[nodiscard]] std::uint64_t memory_of_machine();

}  // namespace terrace::cluster
