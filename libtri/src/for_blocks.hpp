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

namespace terrace::tri {

/// Calls work(begin, end, worker) for consecutive blocks of `block` numbers out of 0 .. count - 1
/// in `threads` threads (0: one per core). make() gives each thread its worker. Which thread takes
/// which block varies, the blocks do not. Rethrows the first exception when all threads have
/// stopped.
template <class Make, class Work>
void for_blocks(std::size_t count, std::size_t block, unsigned threads, Make make, Work work) {
  const std::size_t blocks = (count + block - 1) / block;
  if (threads == 0) threads = std::max(1u, std::thread::hardware_concurrency());
  const std::size_t used = std::clamp<std::size_t>(blocks, 1, std::min(threads, 256u));
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto run = [&] {
    try {
      auto worker = make();
      for (std::size_t b = next++; b < blocks; b = next++)
        work(b * block, std::min(count, (b + 1) * block), worker);
    } catch (...) {
      const std::lock_guard lock(failure_mutex);
      if (!failure) failure = std::current_exception();
      next = blocks;
    }
  };
  std::vector<std::thread> others;  // std::jthread is missing in some standard libraries
  others.reserve(used);
  try {
    for (std::size_t i = 1; i < used; ++i) others.emplace_back(run);
  } catch (const std::system_error&) {
    // The system grants no more threads. The existing ones do the same work.
  } catch (const std::bad_alloc&) {
    // Nor memory for one. Not thrown: those that run would never be joined.
  }
  run();
  for (std::thread& other : others) other.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace terrace::tri
