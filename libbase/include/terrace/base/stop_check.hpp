// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <utility>

namespace terrace::base {

/// Called at intervals during long work, by any of its threads, possibly several at once. An
/// exception that it throws ends the work and reaches the caller. At most a few milliseconds pass
/// between two calls, and often less than a microsecond, so a check should only read a flag. It
/// does not change results.
using StopCheck = std::function<void()>;

/// Calls a check once per 65,536 units of work, of about a nanosecond each. One object per thread.
class StopTicks {
 public:
  /// Checks nothing.
  StopTicks() = default;
  explicit StopTicks(StopCheck check) : check_(std::move(check)) {}

  void operator()(std::size_t work = 1) {
    work_ += work;
    if (work_ >= kBetweenChecks) look();
  }
  /// Calls the check now.
  void look() {
    work_ = 0;
    if (check_) check_();
  }

 private:
  static constexpr std::size_t kBetweenChecks = std::size_t{1} << 16;
  StopCheck check_;
  std::size_t work_ = 0;
};

}  // namespace terrace::base
