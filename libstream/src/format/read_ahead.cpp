// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cassert>
#include <exception>
#include <mutex>
#include <utility>
#include <vector>

#include <terrace/base/work_ahead.hpp>

#include "terrace/stream/source.hpp"

namespace terrace::stream {
namespace {

/// Implements read_ahead().
class ReadAhead final : public PointSource {
 public:
  ReadAhead(std::unique_ptr<PointSource> source, std::size_t blocks,
            const std::stop_source& reading, const std::stop_token& stop)
      : source_(std::move(source)),
        max_blocks_(std::max<std::size_t>(blocks, 1)),
        info_(source_->info()),
        reading_(reading),
        on_stop_(stop, Forward{reading}),
        ahead_(1, [this] { return reader(); }) {
    if (!info_.grid) give_blocks();
  }
  /// The source must not wait for a pipe when its thread is joined.
  ~ReadAhead() override { reading_.request_stop(); }
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  [[nodiscard]] std::uint64_t reading_bytes() const override { return source_->reading_bytes(); }
  void refine(double cell_aspect, std::uint64_t memory_bytes) override {
    assert(ahead_.size() == 0);
    source_->refine(cell_aspect, memory_bytes);
  }

  bool next(PointBlock& block) override {
    give_blocks();
    Ahead ahead = ahead_.take();
    progress_ = ahead.progress;
    std::swap(block, ahead.block);
    if (!ahead.more) {
      block.clear();
      return false;
    }
    // The caller's buffers are used for another block, so that in the long run nothing is allocated
    // or set to zero. If reading is slow, few blocks have buffers.
    {
      const std::lock_guard lock(mutex_);
      if (free_blocks_.size() < max_blocks_) free_blocks_.push_back(std::move(ahead.block));
    }
    ahead_.give({});
    return true;
  }

  /// Returns the progress at the last block delivered.
  [[nodiscard]] Progress progress() const override { return progress_; }

 private:
  struct Ahead {
    PointBlock block{};
    Progress progress{};
    bool more = false;  ///< the source has not ended before this block
  };

  /// Forwards a stop request.
  struct Forward {
    std::stop_source target;
    void operator()() { target.request_stop(); }
  };

  void give_blocks() {
    while (ahead_.size() < max_blocks_) ahead_.give({});
  }

  /// After the end or an error the source is not asked again; the error is thrown every time.
  base::WorkAhead<Ahead>::Work reader() {
    return [this, ended = false, error = std::exception_ptr()](Ahead& ahead) mutable {
      if (error) std::rethrow_exception(error);
      try {
        ahead.block = spare();
        ahead.more = !ended && source_->next(ahead.block);
        ended = !ahead.more;
        ahead.progress = source_->progress();
      } catch (...) {
        error = std::current_exception();
        throw;
      }
    };
  }

  PointBlock spare() {
    PointBlock block;
    const std::lock_guard lock(mutex_);
    if (!free_blocks_.empty()) {
      block = std::move(free_blocks_.back());
      free_blocks_.pop_back();
    }
    return block;
  }

  const std::unique_ptr<PointSource> source_;  // used only by the thread once it runs
  const std::size_t max_blocks_;
  const SourceInfo info_;
  std::stop_source reading_;
  std::stop_callback<Forward> on_stop_;
  Progress progress_;  // used only by the caller
  std::mutex mutex_;
  std::vector<PointBlock> free_blocks_;  // with buffers for further blocks; guarded by mutex_
  base::WorkAhead<Ahead> ahead_;
};

}  // namespace

std::unique_ptr<PointSource> read_ahead(std::unique_ptr<PointSource> source, std::size_t blocks,
                                        const std::stop_source& reading,
                                        const std::stop_token& stop) {
  return std::make_unique<ReadAhead>(std::move(source), blocks, reading, stop);
}

}  // namespace terrace::stream
