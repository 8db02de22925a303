// SPDX-License-Identifier: Apache-2.0
#include "linkage_threads.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace terrace::cluster {

void for_blocks(std::size_t count, std::size_t block, unsigned threads,
                const std::function<void(std::size_t, std::size_t, unsigned)>& work) {
  const std::size_t blocks = (count + block - 1) / block;
  const auto used = static_cast<unsigned>(
      std::min<std::size_t>(std::clamp(threads, 1u, kMostLinkageThreads), blocks));
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto run = [&](unsigned thread) {
    try {
      for (std::size_t b = next++; b < blocks; b = next++) {
        work(b * block, std::min(count, (b + 1) * block), thread);
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      next = blocks;
    }
  };
  std::vector<std::thread> others;
  const auto join = [&] {
    for (std::thread& other : others) other.join();
  };
  try {
    for (unsigned t = 1; t < used; ++t) others.emplace_back(run, t);
  } catch (...) {
    // Fewer threads than asked for do the work as well.
  }
  run(0);
  join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace terrace::cluster
