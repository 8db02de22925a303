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

/// Threads that wait for short loops and start on them within a microsecond: they spin for some
/// tens of microseconds before they sleep. The caller never waits for a thread that has not begun,
/// so on a busy machine only the help is lost. One caller at a time.
class ThreadTeam {
 public:
  /// threads: includes the caller's; 0 counts as 1. The others are started by the first loop, as
  /// many as the system grants.
  explicit ThreadTeam(unsigned threads) : wanted_(std::max(1u, threads)) {}
  ~ThreadTeam() {
    stop_ = true;
    state_.fetch_add(2 * kStep);
    state_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  /// Upper bound of the thread numbers that tasks get.
  [[nodiscard]] unsigned threads() const { return wanted_; }

  /// Calls task(0) ... task(count - 1), each once, on any threads, and returns when all are done.
  /// Calls begin in ascending order. A task may also take the number of its thread, below
  /// threads(), where the caller's is 0: calls with the same number do not overlap. If calls throw,
  /// no more begin, and the exception of the smallest number is rethrown when all have ended.
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
      threads_.reserve(wanted_);
      for (unsigned i = 1; i < wanted_; ++i) threads_.emplace_back([this, i] { help(i); });
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
    state_.fetch_add(kStep);  // no thread is working, so this is odd and ends in 0
    state_.notify_all();
    work(0);
    std::uint64_t state = state_.fetch_add(kStep) + kStep;
    for (int looks = 0; (state & (kStep - 1)) != 0; state = state_.load()) {
      if (looks < kLooks) {
        ++looks;
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
    std::uint64_t done = 0;  // the turn of the last loop that this thread took part in
    int looks = 0;
    for (;;) {
      std::uint64_t state = state_.load();
      if (stop_) return;
      const std::uint64_t turn = state / kStep;
      if (turn % 2 == 1 && turn != done) {
        if (!state_.compare_exchange_weak(state, state + 1)) continue;
        work(thread);
        if ((state_.fetch_sub(1) & (kStep - 1)) == 1) state_.notify_all();
        done = turn;
        looks = 0;
      } else if (looks < kLooks) {
        ++looks;
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

  // Some tens of microseconds.
  static constexpr int kLooks = 4000;
  // The upper half of the state counts turns: odd while a loop runs. The lower half is the number
  // of threads working on it, not counting the caller's.
  static constexpr std::uint64_t kStep = std::uint64_t{1} << 32;

  const unsigned wanted_;
  bool started_ = false;
  std::atomic<std::uint64_t> state_ = 0;
  std::atomic<bool> stop_ = false;
  std::atomic<std::size_t> next_ = 0;
  std::size_t count_ = 0;
  void* task_ = nullptr;
  Call call_ = nullptr;
  std::mutex failure_mutex_;
  std::exception_ptr failure_;
  std::size_t failed_ = 0;
  std::vector<std::thread> threads_;
};

}  // namespace terrace::base
