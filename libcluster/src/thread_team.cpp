// SPDX-License-Identifier: Apache-2.0
#include "thread_team.hpp"

#include <new>
#include <system_error>
#include <utility>

namespace terrace::cluster {
namespace {

// Some tens of microseconds, several times the duration of a gain.
constexpr int kLooks = 4000;

void pause() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#else
  std::this_thread::yield();
#endif
}

}  // namespace

ThreadTeam::ThreadTeam(unsigned threads) {
  threads_.reserve(threads);
  try {
    for (unsigned i = 1; i < threads; ++i) threads_.emplace_back([this, i] { run_thread(i); });
  } catch (const std::system_error&) {
    // The existing threads do the same work.
  } catch (const std::bad_alloc&) {
    // Likewise. Not rethrown: running threads would never be joined.
  }
}

ThreadTeam::~ThreadTeam() {
  stop_ = true;
  state_.fetch_add(2 * kStep);
  state_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void ThreadTeam::run_together(std::size_t count, void* task, Call call) {
  count_ = count;
  task_ = task;
  call_ = call;
  next_.store(0, std::memory_order_relaxed);
  state_.fetch_add(kStep);  // nobody is working, so this is odd and ends in 0
  state_.notify_all();
  work(0);
  state_.fetch_add(kStep);
  for (int looks = 0; (state_.load() & (kStep - 1)) != 0; ++looks) {
    if (looks < kLooks) {
      pause();
    } else {
      std::this_thread::yield();
    }
  }
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void ThreadTeam::work(unsigned thread) {
  for (;;) {
    const std::size_t k = next_.fetch_add(1, std::memory_order_relaxed);
    if (k >= count_) return;
    try {
      call_(task_, k, thread);
    } catch (...) {
      const std::scoped_lock lock(failure_mutex_);
      if (!failure_) failure_ = std::current_exception();
      next_.store(count_, std::memory_order_relaxed);
    }
  }
}

void ThreadTeam::run_thread(unsigned thread) {
  std::uint64_t done = 0;  // the count of the last work this thread took part in
  int looks = 0;
  for (;;) {
    std::uint64_t state = state_.load();
    if (stop_) return;
    const std::uint64_t turn = state / kStep;
    if (turn % 2 == 1 && turn != done) {
      if (!state_.compare_exchange_weak(state, state + 1)) continue;
      work(thread);
      state_.fetch_sub(1);
      done = turn;
      looks = 0;
    } else if (looks < kLooks) {
      ++looks;
      pause();
    } else {
      state_.wait(state);
      // Woken by the start of work or by other threads joining or leaving.
    }
  }
}

}  // namespace terrace::cluster
