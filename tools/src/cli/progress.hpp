// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace terrace::tools {

enum class ProgressMode : std::uint8_t {
  automatic,  ///< a line on a terminal, otherwise nothing
  json,       ///< JSON lines on standard error
  none,
};

/// Shows progress on standard error, at most ten times a second: the rate, the share done and the
/// time left. The destructor clears the line.
class ProgressMeter {
 public:
  /// `what` is the plural noun that is counted, such as "points".
  ProgressMeter(ProgressMode mode, std::string what);
  ~ProgressMeter();
  ProgressMeter(const ProgressMeter&) = delete;
  ProgressMeter& operator=(const ProgressMeter&) = delete;

  /// `count` is the number done so far. `fraction` is the share of the work done, from 0 to 1, or 0
  /// if unknown.
  void update(std::uint64_t count, double fraction);

 private:
  using Clock = std::chrono::steady_clock;

  void show(std::uint64_t count, double fraction, double seconds);

  ProgressMode mode_;
  std::string what_;
  Clock::time_point start_, last_;
  bool line_shown_ = false;
};

}  // namespace terrace::tools
