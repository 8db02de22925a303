// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/matching/large_matching.hpp"

namespace terrace::matching::tree {

/// The default matcher for a level of a matching tree. Returns the partner of each node, kNobody
/// for the one left over. The result must not depend on the number of threads.
template <std::size_t D>
std::vector<std::uint32_t> match_level(std::span<const std::array<double, D>> points,
                                       unsigned threads, const base::StopCheck& check_stop) {
  LargeMatchingOptions options;
  options.threads = threads;
  options.check_stop = check_stop;
  return std::move(match_large(points, options).mate);
}

}  // namespace terrace::matching::tree
