// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "terrace/matching/stop_check.hpp"

namespace terrace::matching {

/// Calls a check once per some 65 000 units of work, of about a nanosecond each. One object per
/// thread.
class StopTicks {
 public:
  /// Checks nothing.
  StopTicks() = default;
  /// check: outlives this object.
  explicit StopTicks(const StopCheck& check) : check_(&check) {}

  void operator()(std::size_t work = 1) {
    work_ += work;
    if (work_ < kBetweenChecks) return;
    work_ = 0;
    if (check_ != nullptr && *check_) (*check_)();
  }

 private:
  static constexpr std::size_t kBetweenChecks = std::size_t{1} << 16;
  const StopCheck* check_ = nullptr;
  std::size_t work_ = 0;
};

}  // namespace terrace::matching
