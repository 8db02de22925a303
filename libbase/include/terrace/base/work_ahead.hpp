// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace terrace::base {

/// Runs tasks on background threads and returns them in the order in which they were given.
///
/// Only one thread, the owner, may call the members. The owner limits memory by limiting size(). To
/// reuse the buffers of a task, it gives the same object again.
template <class Task>
class WorkAhead {
 public:
  using Work = std::function<void(Task&)>;

  /// Each thread calls make_work() before its first task and applies the function that it returns
  /// to all its tasks. That function may own objects of the thread, such as a decoder. The first
  /// give() starts `threads` threads, or as many as the system grants. Without threads, take() does
  /// the work.
  WorkAhead(unsigned threads, std::function<Work()> make_work)
      : requested_threads_(threads), make_work_(std::move(make_work)) {}
  /// Drops the tasks that no thread has begun, and waits for the others.
  ~WorkAhead() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    begin_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  WorkAhead(const WorkAhead&) = delete;
  WorkAhead& operator=(const WorkAhead&) = delete;

  /// Returns the number of tasks that were given and not taken.
  [[nodiscard]] std::size_t size() const { return size_; }
  /// Returns the number of running threads; 0 before the first task.
  [[nodiscard]] std::size_t threads() const { return threads_.size(); }

  /// Appends a task. Never waits.
  void give(Task task) {
    if (!started_) start();
    {
      const std::lock_guard lock(mutex_);
      entries_.push_back({.task = std::move(task)});
    }
    ++size_;
    begin_.notify_one();
  }

  /// Waits for the oldest task and returns it. Requires size() > 0. If the work on the task threw,
  /// removes the task and rethrows the exception.
  Task take() {
    if (threads_.empty()) run_oldest();
    std::unique_lock lock(mutex_);
    completed_.wait(lock, [this] { return entries_.front().complete; });
    Entry entry = std::move(entries_.front());
    entries_.pop_front();
    --begun_;
    lock.unlock();
    --size_;
    if (entry.error) std::rethrow_exception(entry.error);
    return std::move(entry.task);
  }

 private:
  struct Entry {
    Task task;
    std::exception_ptr error{};
    bool complete = false;
  };

  void start() {
    started_ = true;
    try {
      threads_.reserve(requested_threads_);
      for (unsigned i = 0; i < requested_threads_; ++i) threads_.emplace_back([this] { run(); });
    } catch (const std::system_error&) {
      // The system grants no more threads. The existing ones, or take(), do the same work.
    } catch (const std::bad_alloc&) {
      // Likewise. Not rethrown: running threads would never be joined.
    }
  }

  /// Applies `work` to the entry's task. Creates `work` on the first call.
  void run_task(Work& work, Entry& entry) const {
    try {
      if (!work) work = make_work_();
      work(entry.task);
    } catch (...) {
      entry.error = std::current_exception();
    }
  }

  void run_oldest() {
    run_task(owner_work_, entries_.front());
    entries_.front().complete = true;
    ++begun_;
  }

  void run() {
    Work work;
    std::unique_lock lock(mutex_);
    for (;;) {
      begin_.wait(lock, [this] { return stop_ || begun_ < entries_.size(); });
      if (stop_) return;
      // The reference stays valid: take() removes an entry only when it is complete.
      Entry& entry = entries_[begun_++];
      lock.unlock();
      run_task(work, entry);
      lock.lock();
      entry.complete = true;
      completed_.notify_one();
    }
  }

  const unsigned requested_threads_;
  const std::function<Work()> make_work_;
  Work owner_work_;  ///< the owner's work if there are no threads
  // Only the owner uses these two.
  std::size_t size_ = 0;
  bool started_ = false;

  std::mutex mutex_;
  std::condition_variable begin_, completed_;
  std::deque<Entry> entries_;  ///< oldest first
  std::size_t begun_ = 0;      ///< number of entries, from the oldest on, that a thread has begun
  bool stop_ = false;

  std::vector<std::thread> threads_;  ///< last, because the threads use the members above
};

}  // namespace terrace::base
