// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace terrace::terrain {

/// Makes `count` results by several threads, of which the calling one is the first, and takes them
/// in order: make(worker, i) runs on the thread numbered `worker` (0 to threads - 1), in no order,
/// commit(i, result) on any of them, but one at a time and i ascending. So the
/// effect of the commits does not depend on the number of threads, and no thread waits for
/// another's commits while there is something to make. At most two results per thread wait. An
/// exception of make or commit is rethrown, that of the smallest i; other threads stop after their
/// present result.
template <class Make, class Commit>
void in_order(std::size_t count, unsigned threads, const Make& make, const Commit& commit) {
  using Result = decltype(make(0U, std::size_t{0}));
  threads =
      static_cast<unsigned>(std::clamp<std::size_t>(threads, 1, std::max<std::size_t>(count, 1)));
  if (threads == 1) {
    for (std::size_t i = 0; i < count; ++i) commit(i, make(0U, i));
    return;
  }

  struct Slot {
    std::optional<Result> result;
    std::exception_ptr error;
    [[nodiscard]] bool ready() const { return result.has_value() || error != nullptr; }
  };
  const std::size_t ahead = 2 * std::size_t{threads};
  std::vector<Slot> slots(ahead);  // result i waits in slot i modulo their number
  std::mutex mutex;
  std::condition_variable changed;
  std::size_t next = 0, committed = 0;
  bool committing = false, stop = false;
  std::exception_ptr failure;

  // Commits what is ready, in order; the lock is held before and after, but not meanwhile.
  const auto commit_ready = [&](std::unique_lock<std::mutex>& lock) {
    committing = true;
    while (!stop && slots[committed % ahead].ready()) {
      const std::size_t i = committed;
      Slot slot = std::exchange(slots[i % ahead], Slot{});
      lock.unlock();
      if (!slot.error) {
        try {
          commit(i, std::move(*slot.result));
        } catch (...) {
          slot.error = std::current_exception();
        }
      }
      slot.result.reset();
      lock.lock();
      committed = i + 1;
      if (slot.error) {
        failure = slot.error;
        stop = true;
      }
      changed.notify_all();
    }
    committing = false;
  };
  const auto work = [&](unsigned worker) {
    std::unique_lock lock(mutex);
    for (;;) {
      if (!committing) commit_ready(lock);
      if (stop || next == count) return;  // who still makes or commits takes the rest
      if (next == committed + ahead) {
        changed.wait(lock);
        continue;
      }
      const std::size_t i = next++;
      lock.unlock();
      Slot slot;
      try {
        slot.result.emplace(make(worker, i));
      } catch (...) {
        slot.error = std::current_exception();
      }
      lock.lock();
      slots[i % ahead] = std::move(slot);
    }
  };

  {
    std::vector<std::jthread> others;
    // If a thread cannot be started, the existing ones do the work.
    try {
      for (unsigned worker = 1; worker < threads; ++worker) others.emplace_back(work, worker);
    } catch (const std::system_error&) {
    }
    work(0);
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace terrace::terrain
