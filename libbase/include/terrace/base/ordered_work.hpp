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
/// - next(worker) returns the next item, or nullopt at the end.
/// - make(worker, item) computes the result of an item on the same thread, whose number is `worker`
///   (0 to threads - 1).
/// - commit(result) receives the results in the order of the items, on any thread. It may return
///   bool: false ends the work, and no later result is committed.
///
/// Calls of next never overlap, nor do calls of commit, so the effect does not depend on the number
/// of threads. A thread waits only if there is nothing to commit and two results per thread are
/// uncommitted.
///
/// Rethrows the exception of the first item that failed. An exception from next counts for the item
/// that it did not return. After a failure, or when commit ended the work, the other threads finish
/// their current result and stop.
template <class Next, class Make, class Commit>
void each_in_order(unsigned threads, Next&& next, const Make& make, Commit&& commit) {
  using Item = typename std::invoke_result_t<Next&, unsigned>::value_type;
  using Result = std::invoke_result_t<const Make&, unsigned, Item>;
  // Returns whether the work continues.
  const auto commit_one = [&commit](Result&& result) {
    if constexpr (std::is_same_v<std::invoke_result_t<Commit&, Result>, bool>) {
      return commit(std::move(result));
    } else {
      commit(std::move(result));
      return true;
    }
  };
  if (threads <= 1) {
    while (std::optional<Item> item = next(0U)) {
      if (!commit_one(make(0U, std::move(*item)))) return;
    }
    return;
  }

  struct Slot {
    std::optional<Result> result;
    std::exception_ptr error;
    [[nodiscard]] bool ready() const { return result.has_value() || error != nullptr; }
  };
  const std::size_t capacity = 2 * std::size_t{threads};
  std::vector<Slot> slots(capacity);  // result i waits in slot i % capacity
  std::mutex mutex;
  std::condition_variable changed;
  std::size_t issued = 0, committed = 0;
  bool issuing = false, ended = false, committing = false, stop = false;
  std::exception_ptr failure;

  // Commits ready results in order. Unlocks `lock` during each commit.
  const auto commit_ready = [&](std::unique_lock<std::mutex>& lock) {
    committing = true;
    while (!stop && slots[committed % capacity].ready()) {
      Slot slot = std::exchange(slots[committed % capacity], Slot{});
      lock.unlock();
      bool continues = false;
      if (!slot.error) {
        try {
          continues = commit_one(std::move(*slot.result));
        } catch (...) {
          slot.error = std::current_exception();
        }
      }
      slot.result.reset();
      lock.lock();
      ++committed;
      failure = slot.error;
      stop = !continues;
      changed.notify_all();
    }
    committing = false;
  };
  const auto work = [&](unsigned worker) {
    std::unique_lock lock(mutex);
    for (;;) {
      if (!committing) commit_ready(lock);
      if (stop || ended) return;  // the threads that still make or commit do the rest
      if (issuing || issued == committed + capacity) {
        changed.wait(lock);
        continue;
      }
      const std::size_t i = issued;
      issuing = true;
      lock.unlock();
      Slot slot;
      std::optional<Item> item;
      try {
        item = next(worker);
      } catch (...) {
        slot.error = std::current_exception();
      }
      lock.lock();
      issuing = false;
      ended = ended || !item;
      if (item || slot.error) ++issued;
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
      if (slot.ready()) slots[i % capacity] = std::move(slot);
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
/// As in each_in_order(), commit may return false to end the work.
template <class Make, class Commit>
void in_order(std::size_t count, unsigned threads, const Make& make, const Commit& commit) {
  std::size_t issued = 0, committed = 0;
  each_in_order(
      static_cast<unsigned>(std::min<std::size_t>(threads, count)),
      [&](unsigned) { return issued < count ? std::optional(issued++) : std::nullopt; }, make,
      [&](auto&& result) { return commit(committed++, std::forward<decltype(result)>(result)); });
}

}  // namespace terrace::base
