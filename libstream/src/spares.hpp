// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace terrace::stream {

/// A pool of objects that are kept for reuse, for their allocated memory. Thread-safe.
template <class T>
class Spares {
 public:
  /// Returns an object from the pool, in the state in which it was put there, or a new one.
  std::unique_ptr<T> take() {
    const std::lock_guard lock(mutex_);
    if (spares_.empty()) return std::make_unique<T>();
    auto spare = std::move(spares_.back());
    spares_.pop_back();
    return spare;
  }
  void put(std::unique_ptr<T> spare) {
    const std::lock_guard lock(mutex_);
    spares_.push_back(std::move(spare));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> spares_;
};

}  // namespace terrace::stream
