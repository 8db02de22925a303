// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <type_traits>
#include <vector>

namespace terrace::cluster {

/// Threads that wait for short pieces of work and start on them within a microsecond: they spin for
/// a while before they sleep. The caller never waits for a thread that has not begun, so that on a
/// busy machine only the help is lost.
class ThreadTeam {
 public:
  /// threads: includes the caller's; starts as many as the system grants.
  explicit ThreadTeam(unsigned threads);
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  [[nodiscard]] std::size_t threads() const { return threads_.size() + 1; }

  /// Calls task(0) ... task(count - 1), each once, on any threads, and returns when all are done. A
  /// task may also take the number of its thread, below threads(), where the caller's is 0: calls
  /// with the same number do not overlap. Rethrows the first exception when nothing runs any more;
  /// pieces not yet begun are then skipped.
  template <class Task>
  void run(std::size_t count, Task&& task) {
    if (threads_.empty() || count < 2) {
      for (std::size_t k = 0; k < count; ++k) invoke(task, k, 0);
      return;
    }
    run_together(count, &task, [](void* object, std::size_t k, unsigned thread) {
      invoke(*static_cast<std::remove_reference_t<Task>*>(object), k, thread);
    });
  }

 private:
  using Call = void (*)(void*, std::size_t, unsigned);

  template <class Task>
  static void invoke(Task& task, std::size_t k, unsigned thread) {
    if constexpr (std::is_invocable_v<Task&, std::size_t, unsigned>) {
      task(k, thread);
    } else {
      task(k);
    }
  }
  void run_together(std::size_t count, void* task, Call call);
  void work(unsigned thread);
  void run_thread(unsigned thread);

  // The upper half counts work: odd while there is some. The lower half is the number of threads
  // working on it, not counting the caller's.
  static constexpr std::uint64_t kStep = std::uint64_t{1} << 32;
  std::atomic<std::uint64_t> state_ = 0;
  std::atomic<bool> stop_ = false;
  std::atomic<std::size_t> next_ = 0;
  std::size_t count_ = 0;
  void* task_ = nullptr;
  Call call_ = nullptr;
  std::mutex failure_mutex_;
  std::exception_ptr failure_;
  std::vector<std::thread> threads_;
};

}  // namespace terrace::cluster
