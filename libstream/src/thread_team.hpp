// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace terrace::stream {

/// Threads that wait for short pieces of work. A thread that is started anew for each takes a
/// millisecond to begin where the scheduler puts it on the core of its parent.
class ThreadTeam {
 public:
  /// threads: the caller's included. The others are started with the first work, as many as the
  /// system grants.
  explicit ThreadTeam(unsigned threads);
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  /// What the workers are numbered below.
  [[nodiscard]] unsigned threads() const { return wanted_; }

  using Work = std::function<void(std::size_t i, std::size_t worker)>;
  /// Calls work(i, worker) for every i below `count`, worker by worker in ascending order, the
  /// caller being worker 0. Returns when all is done. Throws what the first call that failed threw;
  /// those not begun are then left out. One caller at a time.
  void run(std::size_t count, const Work& work);

 private:
  void start();
  void help(std::size_t worker);
  void take_part(std::size_t worker, std::unique_lock<std::mutex>& lock);

  const unsigned wanted_;
  std::mutex mutex_;
  std::condition_variable news_, done_;
  const Work* work_ = nullptr;        ///< while there is some
  std::size_t next_ = 0, count_ = 0;  ///< of its calls
  std::size_t busy_ = 0;              ///< workers in a call
  std::exception_ptr failure_;
  bool stop_ = false;
  std::vector<std::thread> helpers_;
};

}  // namespace terrace::stream
