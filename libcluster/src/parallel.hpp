// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <thread>

#include "thread_team.hpp"

/// Loops shared by threads that live for one loop: for work that takes milliseconds. The assignment
/// of work to threads varies, so each call must write only to its own memory, or that of its
/// thread.

namespace terrace::cluster {

/// The number of threads requested (0: one per core), but no more than there are pieces of work.
inline unsigned threads_for(std::size_t pieces, unsigned threads) {
  if (threads == 0) threads = std::max(1u, std::thread::hardware_concurrency());
  constexpr std::size_t kMost = 256;
  return static_cast<unsigned>(
      std::clamp<std::size_t>(pieces, 1, std::min<std::size_t>(threads, kMost)));
}

/// Calls work(k), or work(k, thread), for every k below `count`. Rethrows the first exception when
/// all threads have stopped.
template <class Work>
void parallel(std::size_t count, unsigned threads, Work&& work) {
  ThreadTeam(threads_for(count, threads)).run(count, work);
}

/// Calls work(begin, end, thread) for consecutive blocks of `block` numbers out of 0 .. count - 1.
template <class Work>
void parallel_blocks(std::size_t count, std::size_t block, unsigned threads, Work&& work) {
  parallel((count + block - 1) / block, threads, [&](std::size_t b, unsigned thread) {
    work(b * block, std::min(count, (b + 1) * block), thread);
  });
}

}  // namespace terrace::cluster
