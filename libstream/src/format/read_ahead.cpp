// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cassert>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "terrace/stream/source.hpp"

namespace terrace::stream {
namespace {

class ReadAhead final : public PointSource {
 public:
  ReadAhead(std::unique_ptr<PointSource> source, std::size_t blocks,
            const std::stop_source& reading, const std::stop_token& stop)
      : source_(std::move(source)),
        most_(std::max<std::size_t>(blocks, 1)),
        info_(source_->info()),
        reading_(reading),
        on_stop_(stop, Forward{reading}) {
    if (!info_.grid) start();
  }

  ~ReadAhead() override {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    room_.notify_one();
    reading_.request_stop();
    if (thread_.joinable()) thread_.join();
  }
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  [[nodiscard]] std::uint64_t reading_bytes() const override { return source_->reading_bytes(); }
  void refine(double cell_aspect, std::uint64_t memory_bytes) override {
    assert(!started_);
    source_->refine(cell_aspect, memory_bytes);
  }

  bool next(PointBlock& block) override {
    if (!started_) start();
    if (!thread_.joinable()) {
      const bool more = source_->next(block);
      progress_ = source_->progress();
      return more;
    }
    std::unique_lock lock(mutex_);
    news_.wait(lock, [this] { return !ready_.empty() || ended_; });
    if (ready_.empty()) {
      block.clear();
      if (error_) std::rethrow_exception(error_);
      progress_ = last_progress_;
      return false;
    }
    progress_ = ready_.front().progress;
    // The reading thread reuses the caller's buffers, so that in the long run nothing is allocated
    // or set to zero.
    if (spare_.size() < most_) {
      spare_.push_back(std::exchange(block, std::move(ready_.front().block)));
    } else {
      block = std::move(ready_.front().block);
    }
    ready_.pop_front();
    lock.unlock();
    room_.notify_one();
    return true;
  }

  /// As of the last block delivered.
  [[nodiscard]] Progress progress() const override { return progress_; }

 private:
  struct Ready {
    PointBlock block;
    Progress progress;
  };

  /// Forwards a stop request.
  struct Forward {
    std::stop_source to;
    void operator()() { to.request_stop(); }
  };

  void start() {
    started_ = true;
    try {
      thread_ = std::thread([this] { run(); });
    } catch (const std::system_error&) {
      // The system has no more threads: next() reads.
    }
  }

  void run() {
    try {
      while (step()) {
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      error_ = std::current_exception();
    }
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
      last_progress_ = source_->progress();
    }
    news_.notify_one();
  }

  bool step() {
    Ready ready;
    {
      std::unique_lock lock(mutex_);
      room_.wait(lock, [this] { return ready_.size() < most_ || stop_; });
      if (stop_) return false;
      if (!spare_.empty()) {
        ready.block = std::move(spare_.back());
        spare_.pop_back();
      }
    }
    if (!source_->next(ready.block)) return false;
    ready.progress = source_->progress();
    {
      const std::lock_guard lock(mutex_);
      ready_.push_back(std::move(ready));
    }
    news_.notify_one();
    return true;
  }

  const std::unique_ptr<PointSource> source_;  // used only by the thread once it runs
  const std::size_t most_;
  const SourceInfo info_;
  std::stop_source reading_;
  std::stop_callback<Forward> on_stop_;
  Progress progress_;  // used only by the caller
  bool started_ = false;

  std::mutex mutex_;
  std::condition_variable news_, room_;
  std::deque<Ready> ready_;
  std::vector<PointBlock> spare_;
  Progress last_progress_;
  std::exception_ptr error_;
  bool ended_ = false, stop_ = false;

  std::thread thread_;
};

}  // namespace

std::unique_ptr<PointSource> read_ahead(std::unique_ptr<PointSource> source, std::size_t blocks,
                                        const std::stop_source& reading,
                                        const std::stop_token& stop) {
  return std::make_unique<ReadAhead>(std::move(source), blocks, reading, stop);
}

}  // namespace terrace::stream
