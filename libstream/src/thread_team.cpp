// SPDX-License-Identifier: Apache-2.0
#include "thread_team.hpp"

#include <algorithm>
#include <new>
#include <system_error>
#include <utility>

namespace terrace::stream {

ThreadTeam::ThreadTeam(unsigned threads) : wanted_(std::max(1U, threads)) {}

ThreadTeam::~ThreadTeam() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  news_.notify_all();
  for (std::thread& helper : helpers_) helper.join();
}

void ThreadTeam::start() {
  helpers_.reserve(wanted_);
  try {
    while (helpers_.size() + 1 < wanted_) {
      helpers_.emplace_back([this, worker = helpers_.size() + 1] { help(worker); });
    }
  } catch (const std::system_error&) {
    // The system grants no more threads: those there are do it all.
  } catch (const std::bad_alloc&) {
    // Nor memory for one. Not thrown: those that run would never be joined.
  }
}

void ThreadTeam::run(std::size_t count, const Work& work) {
  if (count == 0) return;
  if (wanted_ > 1 && count > 1 && helpers_.empty()) start();
  std::unique_lock lock(mutex_);
  work_ = &work;
  next_ = 0;
  count_ = count;
  news_.notify_all();
  take_part(0, lock);
  done_.wait(lock, [this] { return busy_ == 0; });
  work_ = nullptr;
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void ThreadTeam::help(std::size_t worker) {
  std::unique_lock lock(mutex_);
  for (;;) {
    news_.wait(lock, [this] { return stop_ || (work_ != nullptr && next_ < count_); });
    if (stop_) return;
    take_part(worker, lock);
    if (busy_ == 0) done_.notify_one();
  }
}

/// The lock is held before and after, but not during a call.
void ThreadTeam::take_part(std::size_t worker, std::unique_lock<std::mutex>& lock) {
  while (next_ < count_) {
    const std::size_t i = next_++;
    ++busy_;
    lock.unlock();
    std::exception_ptr failure;
    try {
      (*work_)(i, worker);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    --busy_;
    if (failure) {
      if (!failure_) failure_ = failure;
      next_ = count_;
    }
  }
}

}  // namespace terrace::stream
