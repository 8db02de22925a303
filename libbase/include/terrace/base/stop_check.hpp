// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <utility>

namespace terrace::base {

/// A function that long work calls at intervals, from any of its threads and possibly from several
/// at once. If it throws, the work ends and the exception reaches the caller. At most a few
/// milliseconds pass between two calls, often less than a microsecond, so the function should only
/// read a flag. It does not change results.
using StopCheck = std::function<void()>;

/// Counts units of work, of about a nanosecond each, and calls a check once per 65,536 units. One
/// object per thread.
class StopTicks {
 public:
  /// Creates ticks without a check, which never throw.
  StopTicks() = default;
  explicit StopTicks(StopCheck check) : check_(std::move(check)) {}

  /// Adds `work` units. Throws whatever the check throws.
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
