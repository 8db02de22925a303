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

/// Jobs that threads do ahead of their owner, who takes them back in the order in which it gave
/// them. The owner bounds memory: it gives only as many jobs as may wait, and may give a job that
/// it took again, with its buffers. Only one thread, the owner, may call the members.
template <class Job>
class WorkAhead {
 public:
  using Work = std::function<void(Job&)>;

  /// make_work: called once on each thread, before its first job. The function that it returns does
  /// the jobs of that thread, and may own objects for that thread alone, such as a decoder.
  /// threads: started with the first job, as many as the system grants; with none, take() does the
  /// job.
  WorkAhead(unsigned threads, std::function<Work()> make_work)
      : wanted_(threads), make_work_(std::move(make_work)) {}
  /// Drops the jobs that are not begun, and waits for the others.
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

  /// The number of jobs that were given and not taken.
  [[nodiscard]] std::size_t size() const { return given_ - taken_; }
  /// The number of running threads: 0 before the first job.
  [[nodiscard]] std::size_t threads() const { return threads_.size(); }

  /// Never waits.
  void give(Job job) {
    if (given_ == 0) start();
    {
      const std::lock_guard lock(mutex_);
      entries_.push_back({.job = std::move(job)});
    }
    ++given_;
    begin_.notify_one();
  }

  /// Waits for the oldest job and returns it. There must be one. Rethrows what its work threw; the
  /// job is then gone.
  Job take() {
    if (threads_.empty()) do_oldest();
    std::unique_lock lock(mutex_);
    done_.wait(lock, [this] { return entries_.front().done; });
    Entry entry = std::move(entries_.front());
    entries_.pop_front();
    --begun_;
    lock.unlock();
    ++taken_;
    if (entry.error) std::rethrow_exception(entry.error);
    return std::move(entry.job);
  }

 private:
  struct Entry {
    Job job;
    std::exception_ptr error{};
    bool done = false;
  };

  void start() {
    try {
      threads_.reserve(wanted_);
      for (unsigned i = 0; i < wanted_; ++i) threads_.emplace_back([this] { run(); });
    } catch (const std::system_error&) {
      // The system grants no more threads. The existing ones, or take(), do the same work.
    } catch (const std::bad_alloc&) {
      // Likewise. Not rethrown: running threads would never be joined.
    }
  }

  /// Does the job with `work`, which is made on the first call.
  void do_job(Work& work, Entry& entry) const {
    try {
      if (!work) work = make_work_();
      work(entry.job);
    } catch (...) {
      entry.error = std::current_exception();
    }
  }

  void do_oldest() {
    do_job(own_work_, entries_.front());
    entries_.front().done = true;
    ++begun_;
  }

  void run() {
    Work work;
    std::unique_lock lock(mutex_);
    for (;;) {
      begin_.wait(lock, [this] { return stop_ || begun_ < entries_.size(); });
      if (stop_) return;
      // Stays where it is until it is taken, which is after it is done.
      Entry& entry = entries_[begun_++];
      lock.unlock();
      do_job(work, entry);
      lock.lock();
      entry.done = true;
      done_.notify_one();
    }
  }

  const unsigned wanted_;
  const std::function<Work()> make_work_;
  Work own_work_;                      ///< without threads
  std::size_t given_ = 0, taken_ = 0;  ///< used only by the owner

  std::mutex mutex_;
  std::condition_variable begin_, done_;
  std::deque<Entry> entries_;  ///< the oldest first
  std::size_t begun_ = 0;      ///< how many of them, from the oldest on
  bool stop_ = false;

  std::vector<std::thread> threads_;  ///< last, because they use the members above
};

}  // namespace terrace::base
