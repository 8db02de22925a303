// SPDX-License-Identifier: Apache-2.0
#include "hierarchy/block_pipeline.hpp"

#include <algorithm>
#include <new>
#include <system_error>
#include <utility>

namespace terrace::cluster {
namespace {

// Enough that threads seldom wait for a slow block to be committed. A block takes about 100 kB.
constexpr std::size_t kBlocksPerThread = 4;

}  // namespace

BlockPipeline::BlockPipeline(unsigned threads, Stages stages)
    : stages_(std::move(stages)), limit_(threads > 1 ? kBlocksPerThread * threads : 1) {
  threads_.reserve(threads);
  try {
    for (unsigned i = 1; i < threads; ++i) threads_.emplace_back([this, i] { run_thread(i); });
  } catch (const std::system_error&) {
    // No more threads are available. The existing ones do the same work more slowly.
  } catch (const std::bad_alloc&) {
    // There is no memory for another thread. Not rethrown, because the destructor, which joins the
    // running threads, would not run.
  }
}

BlockPipeline::~BlockPipeline() {
  {
    const Lock lock(mutex_);
    stop_ = true;
    queue_.clear();
  }
  work_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

BlockPipeline::BlockPtr BlockPipeline::take(unsigned level) {
  BlockPtr block;
  {
    const Lock lock(mutex_);
    if (!free_.empty()) {
      block = std::move(free_.back());
      free_.pop_back();
    }
  }
  if (!block) block = std::make_unique<HierarchyBlock>();
  block->reset(level);
  return block;
}

void BlockPipeline::submit(BlockPtr block) {
  {
    const Lock lock(mutex_);
    if (failed_ || stop_) return;
    if (lanes_.size() <= block->level) lanes_.resize(block->level + 1);
    queue_.push_back(std::move(block));
    ++in_progress_;
  }
  work_.notify_one();
  progress_.notify_all();  // the owner may be waiting for work
}

void BlockPipeline::run_thread(unsigned thread) {
  Lock lock(mutex_);
  for (;;) {
    work_.wait(lock, [this] { return stop_ || !queue_.empty(); });
    if (stop_) return;
    run_one(lock, thread);
  }
}

void BlockPipeline::wait_until_below(std::size_t limit) {
  Lock lock(mutex_);
  while (!failed_ && in_progress_ >= limit) {
    if (queue_.empty()) {
      progress_.wait(lock);
    } else {
      run_one(lock, 0);
    }
  }
  if (failed_) {
    progress_.wait(lock, [this] { return running_ == 0; });
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  }
}

void BlockPipeline::run_one(Lock& lock, unsigned thread) {
  BlockPtr block = std::move(queue_.front());
  queue_.pop_front();
  ++running_;
  lock.unlock();
  std::exception_ptr failure;
  try {
    stages_.process(*block, thread);
  } catch (...) {
    failure = std::current_exception();
  }
  lock.lock();
  try {
    if (failure) std::rethrow_exception(failure);
    lanes_[block->level].ready.push_back(std::move(block));
    commit_ready(lock);
  } catch (...) {
    fail(std::current_exception());
  }
  --running_;
  progress_.notify_all();
}

void BlockPipeline::commit_ready(Lock& lock) {
  if (committing_) return;  // the committing thread checks again before it stops
  committing_ = true;
  while (BlockPtr block = next_ready()) {
    lock.unlock();
    std::exception_ptr failure;
    try {
      stages_.commit(*block);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    if (failure) {
      fail(std::move(failure));
      break;
    }
    ++lanes_[block->level].next;
    free_.push_back(std::move(block));
    --in_progress_;
    progress_.notify_all();
  }
  committing_ = false;
}

BlockPipeline::BlockPtr BlockPipeline::next_ready() {
  if (failed_ || stop_) return nullptr;
  for (Lane& lane : lanes_) {
    const auto next = std::find_if(lane.ready.begin(), lane.ready.end(),
                                   [&](const BlockPtr& b) { return b->number == lane.next; });
    if (next == lane.ready.end()) continue;
    BlockPtr block = std::move(*next);
    lane.ready.erase(next);
    return block;
  }
  return nullptr;
}

void BlockPipeline::fail(std::exception_ptr failure) {
  queue_.clear();
  if (failed_) return;  // only the first failure is kept
  failed_ = true;
  failure_ = std::move(failure);
  if (stages_.failed) stages_.failed();
}

}  // namespace terrace::cluster
