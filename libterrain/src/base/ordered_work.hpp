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

namespace terrace::terrain {

/// Makes something of each item of a sequence by several threads, of which the calling one is the
/// first, and takes the results in order: next(worker) gives the items as optionals until an empty
/// one, then make(worker, item) runs on the same thread, whose number `worker` is (0 to threads -
/// 1), and commit(result) takes the results in the order of the items, on any of the threads. next
/// and commit run one at a time each. So the effect does not depend on the number of threads, and
/// no thread waits for another's commits while there is something to make. At most two results per
/// thread wait. Of the exceptions the one of the first item is rethrown, that of next counting as
/// that of the item it did not give; other threads stop after their present result.
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
  std::vector<Slot> slots(ahead);  // result i waits in slot i modulo their number
  std::mutex mutex;
  std::condition_variable changed;
  std::size_t given = 0, committed = 0;
  bool giving = false, ended = false, committing = false, stop = false;
  std::exception_ptr failure;

  // Commits what is ready, in order; the lock is held before and after, but not meanwhile.
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
      if (stop || ended) return;  // who still makes or commits takes the rest
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
    // If a thread cannot be started, the existing ones do the work.
    try {
      for (unsigned worker = 1; worker < threads; ++worker) others.emplace_back(work, worker);
    } catch (const std::system_error&) {
    }
    work(0);
  }
  if (failure) std::rethrow_exception(failure);
}

/// The same for the numbers below `count`: make(worker, i), commit(i, result).
template <class Make, class Commit>
void in_order(std::size_t count, unsigned threads, const Make& make, const Commit& commit) {
  std::size_t given = 0, committed = 0;
  each_in_order(
      static_cast<unsigned>(std::min<std::size_t>(threads, count)),
      [&](unsigned) { return given < count ? std::optional(given++) : std::nullopt; }, make,
      [&](auto&& result) { commit(committed++, std::forward<decltype(result)>(result)); });
}

}  // namespace terrace::terrain
