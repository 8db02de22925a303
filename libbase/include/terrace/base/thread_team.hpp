// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace terrace::base {

/// Threads for many short loops. They start on a loop within a microsecond, because they spin for
/// some tens of microseconds before they sleep. The caller never waits for a thread that has not
/// begun, so on a busy machine the loop is slower but never stuck. One caller at a time.
class ThreadTeam {
 public:
  /// threads: number of threads, including the caller's; 0 counts as 1. The first loop starts the
  /// others, or as many as the system grants.
  explicit ThreadTeam(unsigned threads) : thread_count_(std::max(1u, threads)) {}
  ~ThreadTeam() {
    stop_ = true;
    state_.fetch_add(2 * kStep);
    state_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  /// Returns the number of threads. Tasks get smaller thread numbers.
  [[nodiscard]] unsigned threads() const { return thread_count_; }

  /// Calls task(0) ... task(count - 1), each once, on any threads, and returns when all are done.
  /// Calls begin in ascending order. A task may also be called as task(i, thread), where `thread`
  /// is the number of the calling thread; the caller's is 0. Calls with the same thread number do
  /// not overlap. After an exception no more calls begin. When all have ended, the exception of the
  /// smallest i is rethrown.
  template <class Task>
  void run(std::size_t count, Task&& task) {
    if (count > 1 && !started_) start();
    if (threads_.empty() || count < 2) {
      for (std::size_t i = 0; i < count; ++i) invoke(task, i, 0);
      return;
    }
    using Object = std::remove_reference_t<Task>;
    run_together(count, const_cast<void*>(static_cast<const void*>(&task)),
                 [](void* object, std::size_t i, unsigned thread) {
                   invoke(*static_cast<Object*>(object), i, thread);
                 });
  }

 private:
  using Call = void (*)(void*, std::size_t, unsigned);

  template <class Task>
  static void invoke(Task& task, std::size_t i, unsigned thread) {
    if constexpr (std::is_invocable_v<Task&, std::size_t, unsigned>) {
      task(i, thread);
    } else {
      task(i);
    }
  }

  void start() {
    started_ = true;
    try {
      threads_.reserve(thread_count_);
      for (unsigned i = 1; i < thread_count_; ++i) threads_.emplace_back([this, i] { help(i); });
    } catch (const std::system_error&) {
      // The system grants no more threads. The existing ones do the same work.
    } catch (const std::bad_alloc&) {
      // Likewise. Not rethrown: running threads would never be joined.
    }
  }

  void run_together(std::size_t count, void* task, Call call) {
    count_ = count;
    task_ = task;
    call_ = call;
    next_.store(0, std::memory_order_relaxed);
    state_.fetch_add(kStep);  // the turn becomes odd; no other thread is working
    state_.notify_all();
    work(0);
    std::uint64_t state = state_.fetch_add(kStep) + kStep;
    for (int spins = 0; (state & (kStep - 1)) != 0; state = state_.load()) {
      if (spins < kSpins) {
        ++spins;
        pause();
      } else {
        state_.wait(state);
      }
    }
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  }

  void work(unsigned thread) {
    for (;;) {
      const std::size_t i = next_.fetch_add(1, std::memory_order_relaxed);
      if (i >= count_) return;
      try {
        call_(task_, i, thread);
      } catch (...) {
        const std::scoped_lock lock(failure_mutex_);
        // All smaller numbers have begun, so the smallest that fails is found.
        if (!failure_ || i < failed_) {
          failure_ = std::current_exception();
          failed_ = i;
        }
        next_.store(count_, std::memory_order_relaxed);
      }
    }
  }

  void help(unsigned thread) {
    std::uint64_t last_turn = 0;  // the last loop that this thread worked on
    int spins = 0;
    for (;;) {
      std::uint64_t state = state_.load();
      if (stop_) return;
      const std::uint64_t turn = state / kStep;
      if (turn % 2 == 1 && turn != last_turn) {
        if (!state_.compare_exchange_weak(state, state + 1)) continue;
        work(thread);
        if ((state_.fetch_sub(1) & (kStep - 1)) == 1) state_.notify_all();
        last_turn = turn;
        spins = 0;
      } else if (spins < kSpins) {
        ++spins;
        pause();
      } else {
        state_.wait(state);
        // Woken by the start of a loop or by other threads joining or leaving.
      }
    }
  }

  static void pause() {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#else
    std::this_thread::yield();
#endif
  }

  // Number of spins before a thread sleeps: some tens of microseconds.
  static constexpr int kSpins = 4000;
  // The upper half of the state counts turns: odd while a loop runs. The lower half is the number
  // of threads working on it, not counting the caller's.
  static constexpr std::uint64_t kStep = std::uint64_t{1} << 32;

  const unsigned thread_count_;
  bool started_ = false;
  std::atomic<std::uint64_t> state_ = 0;
  std::atomic<bool> stop_ = false;
  std::atomic<std::size_t> next_ = 0;
  std::size_t count_ = 0;
  void* task_ = nullptr;
  Call call_ = nullptr;
  std::mutex failure_mutex_;
  std::exception_ptr failure_;
  std::size_t failed_ = 0;  // the number of the call that threw failure_
  std::vector<std::thread> threads_;
};

}  // namespace terrace::base
