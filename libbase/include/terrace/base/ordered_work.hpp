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
#include <type_traits>
#include <utility>
#include <vector>

namespace terrace::base {

/// Runs a pipeline on `threads` threads, including the caller's.
///
/// next(worker) returns the next item, or nullopt at the end. make(worker, item) computes its
/// result on the same thread, whose number is `worker` (0 to threads - 1). commit(result) receives
/// the results in the order of the items, on any thread. Neither next nor commit is called while
/// another call of it runs, so the effect does not depend on the number of threads. No thread waits
/// for another's commit while there is work. At most two results per thread are waiting.
///
/// Rethrows the exception of the first item that failed; an exception from next counts for the item
/// that it did not return. Other threads then stop after their current result.
template <class Next, class Make, class Commit>
void each_in_order(unsigned threads, Next&& next, const Make& make, Commit&& commit) {
  using Item = typename std::invoke_result_t<Next&, unsigned>::value_type;
  using Result = std::invoke_result_t<const Make&, unsigned, Item>;
  if (threads <= 1) {
    while (std::optional<Item> item = next(0U)) commit(make(0U, std::move(*item)));
    return;
  }

  struct Slot {
    std::optional<Result> result;
    std::exception_ptr error;
    [[nodiscard]] bool ready() const { return result.has_value() || error != nullptr; }
  };
  const std::size_t ahead = 2 * std::size_t{threads};
  std::vector<Slot> slots(ahead);  // result i waits in slot i % ahead
  std::mutex mutex;
  std::condition_variable changed;
  std::size_t given = 0, committed = 0;
  bool giving = false, ended = false, committing = false, stop = false;
  std::exception_ptr failure;

  // Commits ready results in order. The lock is held before and after, but not during a commit.
  const auto commit_ready = [&](std::unique_lock<std::mutex>& lock) {
    committing = true;
    while (!stop && slots[committed % ahead].ready()) {
      Slot slot = std::exchange(slots[committed % ahead], Slot{});
      lock.unlock();
      if (!slot.error) {
        try {
          commit(std::move(*slot.result));
        } catch (...) {
          slot.error = std::current_exception();
        }
      }
      slot.result.reset();
      lock.lock();
      ++committed;
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
      if (stop || ended) return;  // the threads that still make or commit take the rest
      if (giving || given == committed + ahead) {
        changed.wait(lock);
        continue;
      }
      const std::size_t i = given;
      giving = true;
      lock.unlock();
      Slot slot;
      std::optional<Item> item;
      try {
        item = next(worker);
      } catch (...) {
        slot.error = std::current_exception();
      }
      lock.lock();
      giving = false;
      ended = ended || !item;
      if (item || slot.error) ++given;
      changed.notify_all();
      if (item) {
        lock.unlock();
        try {
          slot.result.emplace(make(worker, std::move(*item)));
        } catch (...) {
          slot.error = std::current_exception();
        }
        lock.lock();
      }
      if (slot.ready()) slots[i % ahead] = std::move(slot);
    }
  };

  {
    std::vector<std::jthread> others;
    // If a thread cannot be started, the existing threads do the work.
    try {
      for (unsigned worker = 1; worker < threads; ++worker) others.emplace_back(work, worker);
    } catch (const std::system_error&) {
    }
    work(0);
  }
  if (failure) std::rethrow_exception(failure);
}

/// Runs make(worker, i) for i = 0 to count - 1 on several threads, and commit(i, result) in order.
template <class Make, class Commit>
void in_order(std::size_t count, unsigned threads, const Make& make, const Commit& commit) {
  std::size_t given = 0, committed = 0;
  each_in_order(
      static_cast<unsigned>(std::min<std::size_t>(threads, count)),
      [&](unsigned) { return given < count ? std::optional(given++) : std::nullopt; }, make,
      [&](auto&& result) { commit(committed++, std::forward<decltype(result)>(result)); });
}

}  // namespace terrace::base
