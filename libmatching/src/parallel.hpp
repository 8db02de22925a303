// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace terrace::matching {

/// Calls work(k) for k below count, concurrently. `watch` is called by the caller's thread after
/// each of its own; if it returns false, no further k is begun.
/// Returns whether all were done. Rethrows the exception of the first k that failed.
inline bool for_each_index(std::size_t count, unsigned threads,
                           const std::function<void(std::size_t)>& work,
                           const std::function<bool()>& watch = {}) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> stopped{false};
  threads = std::max(1u, threads);
  std::vector<std::pair<std::size_t, std::exception_ptr>> failures(threads, {count, nullptr});
  const auto run = [&](unsigned t) {
    for (std::size_t k; !stopped && (k = next++) < count;) {
      try {
        work(k);
        if (t == 0 && watch && !watch()) stopped = true;
      } catch (...) {
        failures[t] = {k, std::current_exception()};
        stopped = true;
      }
    }
  };
  {
    std::vector<std::jthread> others;
    try {
      for (unsigned t = 1; t < threads && t < count; ++t) others.emplace_back(run, t);
    } catch (const std::system_error&) {
      // The system grants no more threads. The existing ones do the same work.
    }
    run(0);
  }
  std::pair<std::size_t, std::exception_ptr> first{count, nullptr};
  for (const auto& failure : failures) {
    if (failure.second && failure.first <= first.first) first = failure;
  }
  if (first.second) std::rethrow_exception(first.second);
  return !stopped;
}

}  // namespace terrace::matching
