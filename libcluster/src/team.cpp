// SPDX-License-Identifier: Apache-2.0
#include "team.hpp"

namespace terrace::cluster {

Team::Team(unsigned threads) {
  threads_.reserve(threads - 1);
  for (unsigned thread = 1; thread < threads; ++thread) {
    threads_.emplace_back([this, thread] {
      std::size_t seen = 0;
      std::unique_lock lock(mutex_);
      for (;;) {
        begin_.wait(lock, [&] { return stop_ || round_ != seen; });
        if (stop_) return;
        seen = round_;
        lock.unlock();
        share(thread);
        lock.lock();
        if (--busy_ == 0) end_.notify_one();
      }
    });
  }
}

Team::~Team() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  begin_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void Team::share(unsigned thread) {
  for (std::size_t task = next_++; task < tasks_; task = next_++) (*work_)(task, thread);
}

void Team::run(std::size_t tasks, const std::function<void(std::size_t, unsigned)>& work) {
  if (threads_.empty() || tasks <= 1) {
    for (std::size_t task = 0; task < tasks; ++task) work(task, 0);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    work_ = &work;
    tasks_ = tasks;
    next_ = 0;
    busy_ = static_cast<unsigned>(threads_.size());
    ++round_;
  }
  begin_.notify_all();
  share(0);
  std::unique_lock lock(mutex_);
  end_.wait(lock, [&] { return busy_ == 0; });
}

}  // namespace terrace::cluster
