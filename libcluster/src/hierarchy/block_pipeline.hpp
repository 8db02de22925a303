// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "hierarchy/block.hpp"

/// Processes blocks on several threads and commits them in order. Private to the hierarchy.

namespace terrace::cluster {

/// Passes blocks through two stages. All threads run `process` concurrently. One thread at a time
/// runs `commit`, for each level in the order of block numbers 0, 1, ... The owner's thread is one
/// of the threads and works whenever it would have to wait. With one thread everything happens
/// there, immediately.
///
/// The first exception of a stage ends the work. Queued blocks are dropped. When all threads are
/// idle, the owner's next waiting call throws the exception, once.
class BlockPipeline {
 public:
  using BlockPtr = std::unique_ptr<HierarchyBlock>;
  struct Stages {
    std::function<void(HierarchyBlock&, unsigned thread)> process;
    /// May submit further blocks of higher levels.
    std::function<void(HierarchyBlock&)> commit;
    /// Called once, after the first failure, unless empty.
    std::function<void()> failed{};
  };

  /// Starts threads - 1 threads, or as many as the system grants. The numbers of threads that
  /// stages get are below `threads`.
  BlockPipeline(unsigned threads, Stages stages);
  /// Drops queued blocks and waits for running ones.
  ~BlockPipeline();
  BlockPipeline(const BlockPipeline&) = delete;
  BlockPipeline& operator=(const BlockPipeline&) = delete;

  /// Returns an empty block of that level, recycled or new.
  BlockPtr take(unsigned level);
  /// Queues a block. Never waits, so commit may call it. Drops the block after a failure.
  void submit(BlockPtr block);

  // Only for the owner's thread:

  /// Waits until another block may be submitted. A few per thread may be in progress.
  void wait_for_room() { wait_until_below(limit_); }
  /// Waits until all blocks are committed, including those that commit submits.
  void wait_for_all() { wait_until_below(1); }

 private:
  using Lock = std::unique_lock<std::mutex>;

  void run_thread(unsigned thread);
  void wait_until_below(std::size_t limit);
  void run_one(Lock& lock, unsigned thread);
  void commit_ready(Lock& lock);
  BlockPtr next_ready();
  void fail(std::exception_ptr failure);

  // The blocks of one level that are processed but not committed. They are few, so not sorted.
  struct Lane {
    std::uint64_t next = 0;
    std::vector<BlockPtr> ready;
  };

  const Stages stages_;
  std::size_t limit_;

  std::mutex mutex_;  // guards all members below except threads_
  std::condition_variable work_, progress_;
  std::deque<BlockPtr> queue_;
  std::vector<Lane> lanes_;      // by level
  std::vector<BlockPtr> free_;   // for reuse
  std::size_t in_progress_ = 0;  // blocks submitted but not yet committed
  std::size_t running_ = 0;      // threads inside run_one()
  bool committing_ = false;
  bool stop_ = false;
  bool failed_ = false;
  std::exception_ptr failure_;  // until it is thrown

  std::vector<std::thread> threads_;
};

}  // namespace terrace::cluster
