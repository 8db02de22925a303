// SPDX-License-Identifier: Apache-2.0
#include "base/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include <terrace/stream/error.hpp>

namespace terrace::terrain {

void parallel_for(std::size_t items, unsigned threads,
                  const std::function<void(unsigned, std::size_t)>& work,
                  const std::stop_token& stop) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  std::size_t failed_item = items;
  const auto run = [&](unsigned thread) {
    for (std::size_t item = next++; item < items; item = next++) {
      try {
        if (stop.stop_requested()) throw stream::Stopped();
        work(thread, item);
      } catch (...) {
        const std::lock_guard lock(mutex);
        // All items before this one have begun, so the smallest that fails is found.
        if (item < failed_item) {
          failed_item = item;
          failure = std::current_exception();
        }
        next = items;
      }
    }
  };
  {
    std::vector<std::jthread> helpers;
    const std::size_t wanted = std::min<std::size_t>(threads, items);
    try {
      for (unsigned thread = 1; thread < wanted; ++thread) helpers.emplace_back(run, thread);
    } catch (const std::system_error&) {
      // The system grants no more threads: the existing ones do the work.
    }
    run(0);
  }
  if (failure) std::rethrow_exception(failure);
}

void for_bands(std::uint32_t rows, unsigned threads,
               const std::function<void(std::uint32_t, std::uint32_t)>& work,
               const std::stop_token& stop) {
  const std::uint32_t bands = std::clamp<std::uint32_t>(threads * 4, 1, std::max(rows / 16, 1u));
  parallel_for(
      bands, threads,
      [&](unsigned, std::size_t band) {
        work(static_cast<std::uint32_t>(std::uint64_t{rows} * band / bands),
             static_cast<std::uint32_t>(std::uint64_t{rows} * (band + 1) / bands));
      },
      stop);
}

}  // namespace terrace::terrain
