// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <stop_token>

namespace terrace::stream {

/// Waits until a descriptor is ready, or for a stop.
class StopWaiter {
 public:
  /// Throws: Error if there are too many open files.
  explicit StopWaiter(const std::stop_token& stop);
  ~StopWaiter();
  StopWaiter(const StopWaiter&) = delete;
  StopWaiter& operator=(const StopWaiter&) = delete;

  /// Returns when `descriptor` is ready for `events` of poll(), or has ended or failed, which the
  /// next read or write reports. Throws: Stopped.
  void wait(int descriptor, short events) const;

 private:
  std::stop_token stop_;
  int read_end_ = -1, write_end_ = -1;  ///< of a pipe: readable from the stop on
  std::optional<std::stop_callback<std::function<void()>>> on_stop_;
};

}  // namespace terrace::stream
