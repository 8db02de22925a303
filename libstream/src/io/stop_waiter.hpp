// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <stop_token>

namespace terrace::stream {

/// Waits for a descriptor to become ready, or for a stop request.
class StopWaiter {
 public:
  /// Throws: Error if too many files are open.
  explicit StopWaiter(const std::stop_token& stop);
  ~StopWaiter();
  StopWaiter(const StopWaiter&) = delete;
  StopWaiter& operator=(const StopWaiter&) = delete;

  /// Returns when `descriptor` is ready for `events` of poll(), or is at its end or has failed,
  /// which the next read or write reports. Throws: Stopped.
  void wait(int descriptor, short events) const;

 private:
  std::stop_token stop_;
  int read_end_ = -1, write_end_ = -1;  ///< pipe that becomes readable with the stop request
  std::optional<std::stop_callback<std::function<void()>>> on_stop_;
};

}  // namespace terrace::stream
