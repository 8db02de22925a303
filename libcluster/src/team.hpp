// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace terrace::cluster {

/// Threads that wait for loops to share. Its owner is one of them.
class Team {
 public:
  /// threads: at least 1; with 1 no thread is started.
  explicit Team(unsigned threads);
  ~Team();
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  [[nodiscard]] unsigned size() const { return static_cast<unsigned>(threads_.size()) + 1; }

  /// Calls work(task, thread) once for each task below `tasks`, in any order, and returns when all
  /// are done. thread < size(); calls with the same number do not overlap. `work` must not throw.
  void run(std::size_t tasks, const std::function<void(std::size_t, unsigned)>& work);

 private:
  void share(unsigned thread);

  std::mutex mutex_;
  std::condition_variable begin_;
  std::condition_variable end_;
  const std::function<void(std::size_t, unsigned)>* work_ = nullptr;
  std::size_t tasks_ = 0;
  std::atomic<std::size_t> next_{0};
  std::size_t round_ = 0;
  unsigned busy_ = 0;
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace terrace::cluster
