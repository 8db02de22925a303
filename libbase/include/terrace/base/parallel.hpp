// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <thread>
#include <type_traits>
#include <vector>

#ifndef __EMSCRIPTEN__
#include "terrace/base/thread_team.hpp"
#endif

/// Loops on several threads, which live for one loop. They pay off for work that takes
/// milliseconds. The distribution of work to threads varies from run to run, so each call must
/// write only to its own memory or to that of its thread. In WebAssembly the caller's thread does
/// everything.

namespace terrace::base {

/// Returns the number of threads for `parts` independent parts of work: `threads`, where 0 means
/// one per core, but at most 256 and at most one per part.
[[nodiscard]] inline unsigned threads_for(std::size_t parts, unsigned threads) {
  if (threads == 0) threads = std::max(1u, std::thread::hardware_concurrency());
  constexpr std::size_t kMost = 256;
  return static_cast<unsigned>(
      std::clamp<std::size_t>(parts, 1, std::min<std::size_t>(threads, kMost)));
}

/// Calls work(i), or work(i, thread), once for every i below `count`. `thread` is below
/// threads_for(count, threads). Calls begin in ascending order. After an exception no more calls
/// begin. When all have ended, the exception of the smallest i is rethrown.
template <class Work>
void parallel_for(std::size_t count, unsigned threads, Work&& work) {
#ifdef __EMSCRIPTEN__
  (void)threads;
  for (std::size_t i = 0; i < count; ++i) {
    if constexpr (std::is_invocable_v<Work&, std::size_t, unsigned>) {
      work(i, 0u);
    } else {
      work(i);
    }
  }
#else
  ThreadTeam(threads_for(count, threads)).run(count, work);
#endif
}

/// Calls work(begin, end), or work(begin, end, thread), for each block of `block` consecutive
/// numbers of 0 ... count - 1. The last block may be shorter. Otherwise as parallel_for().
template <class Work>
void parallel_blocks(std::size_t count, std::size_t block, unsigned threads, Work&& work) {
  parallel_for((count + block - 1) / block, threads, [&](std::size_t b, unsigned thread) {
    const std::size_t begin = b * block, end = std::min(count, begin + block);
    if constexpr (std::is_invocable_v<Work&, std::size_t, std::size_t, unsigned>) {
      work(begin, end, thread);
    } else {
      work(begin, end);
    }
  });
}

/// Calls work(begin, end, helper), where each thread has its own helper, such as scratch memory.
/// The thread creates it with make() before its first block. Otherwise as above.
template <class Make, class Work>
void parallel_blocks(std::size_t count, std::size_t block, unsigned threads, Make&& make,
                     Work&& work) {
  const std::size_t blocks = (count + block - 1) / block;
  std::vector<std::optional<std::invoke_result_t<Make&>>> helpers(threads_for(blocks, threads));
  parallel_blocks(count, block, threads, [&](std::size_t begin, std::size_t end, unsigned thread) {
    auto& helper = helpers[thread];
    if (!helper) helper.emplace(make());
    work(begin, end, *helper);
  });
}

}  // namespace terrace::base
