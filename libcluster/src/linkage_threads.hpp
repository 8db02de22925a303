// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

/// Private to linkage.

namespace terrace::cluster {

inline constexpr unsigned kMostLinkageThreads = 256;

/// Calls work(begin, end, thread) for consecutive blocks of `block` numbers out of 0..count-1. A
/// thread takes its blocks in ascending order. The first exception comes out when all have stopped.
void for_blocks(std::size_t count, std::size_t block, unsigned threads,
                const std::function<void(std::size_t, std::size_t, unsigned)>& work);

}  // namespace terrace::cluster
