// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <vector>

namespace terrace::stream::store {

/// Calls work(i, worker) for every i below `count`, worker by worker in ascending order, on up to
/// `threads` threads, this one being worker 0. Throws what the first call that failed threw.
template <class Work>
void side_by_side(unsigned threads, std::size_t count, Work&& work) {
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  const auto run = [&](std::size_t worker) {
    try {
      for (std::size_t i = next++; i < count; i = next++) work(i, worker);
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  std::vector<std::thread> helpers;
  helpers.reserve(threads);
  try {
    for (std::size_t worker = 1; worker < std::min<std::size_t>(threads, count); ++worker) {
      helpers.emplace_back(run, worker);
    }
  } catch (const std::system_error&) {
    // The system grants no more threads: those there are do it all.
  } catch (const std::bad_alloc&) {
    // Nor memory for one. Not thrown: those that run would never be joined.
  }
  run(0);
  for (std::thread& helper : helpers) helper.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace terrace::stream::store
