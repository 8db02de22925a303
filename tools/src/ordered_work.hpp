// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace terrace::tools {

/// Makes `count` results by several threads and takes them in order: make(worker, i) runs on the
/// thread numbered `worker` (0 to threads - 1), in no order, commit(i, result) on the calling
/// thread, i ascending. So what commits leave behind does not depend on the number of threads. At
/// most two results per thread wait. What make or commit throws comes out, of several makes that of
/// the smallest i; the other threads end with the result that they are at.
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
  };
  const std::size_t ahead = 2 * std::size_t{threads};
  std::vector<Slot> slots(ahead);  // result i waits in slot i modulo their number
  std::mutex mutex;
  std::condition_variable changed;
  std::size_t next = 0, committed = 0;
  bool stop = false;

  const auto work = [&](unsigned worker) {
    for (;;) {
      std::size_t i = 0;
      {
        std::unique_lock lock(mutex);
        changed.wait(lock, [&] { return stop || next == count || next < committed + ahead; });
        if (stop || next == count) return;
        i = next++;
      }
      Slot slot;
      try {
        slot.result.emplace(make(worker, i));
      } catch (...) {
        slot.error = std::current_exception();
      }
      const std::lock_guard lock(mutex);
      slots[i % ahead] = std::move(slot);
      changed.notify_all();
    }
  };

  std::vector<std::jthread> workers;
  // Before the threads are joined, whatever happens.
  struct Stopper {
    std::mutex& mutex;
    std::condition_variable& changed;
    bool& stop;
    ~Stopper() {
      const std::lock_guard lock(mutex);
      stop = true;
      changed.notify_all();
    }
  };
  for (unsigned worker = 0; worker < threads; ++worker) workers.emplace_back(work, worker);
  const Stopper stopper{mutex, changed, stop};
  for (std::size_t i = 0; i < count; ++i) {
    Slot slot;
    {
      std::unique_lock lock(mutex);
      Slot& place = slots[i % ahead];
      changed.wait(lock, [&] { return place.result.has_value() || place.error != nullptr; });
      slot = std::exchange(place, Slot{});
      committed = i + 1;
      changed.notify_all();
    }
    if (slot.error) std::rethrow_exception(slot.error);
    commit(i, std::move(*slot.result));
  }
}

}  // namespace terrace::tools
