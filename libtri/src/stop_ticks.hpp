// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>

#include "terrace/tri/stop_check.hpp"

namespace terrace::tri {

/// Calls a check once per some 65 000 units of work, of about a nanosecond each. One object per
/// thread.
class StopTicks {
 public:
  /// Checks nothing.
  StopTicks() = default;
  explicit StopTicks(StopCheck check) : check_(std::move(check)) {}

  void operator()(std::size_t work = 1) {
    work_ += work;
    if (work_ >= kBetweenChecks) look();
  }
  /// Calls the check at once.
  void look() {
    work_ = 0;
    if (check_) check_();
  }

 private:
  static constexpr std::size_t kBetweenChecks = std::size_t{1} << 16;
  StopCheck check_;
  std::size_t work_ = 0;
};

}  // namespace terrace::tri
