// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {
namespace {

/// Blocks of one point each, numbered; then the end, or an Error.
class Counting final : public PointSource {
 public:
  Counting(int blocks, bool fails, std::atomic<int>* blocks_read = nullptr)
      : blocks_(blocks), fails_(fails), blocks_read_(blocks_read) {
    info_.format = "counting";
  }
  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  bool next(PointBlock& block) override {
    block.clear();
    if (next_ == blocks_) {
      if (fails_) throw Error("x", "broken");
      return false;
    }
    block.positions.push_back({static_cast<double>(next_++), 0, 0});
    if (blocks_read_ != nullptr) *blocks_read_ = next_;
    return true;
  }
  [[nodiscard]] Progress progress() const override {
    return {.points = static_cast<std::uint64_t>(next_)};
  }

 private:
  int blocks_, next_ = 0;
  bool fails_;
  std::atomic<int>* blocks_read_;
  SourceInfo info_;
};

TEST(ReadAhead, DeliversTheSameStream) {
  for (const std::size_t ahead : {0u, 1u, 2u, 8u, 1000u}) {
    for (const int blocks : {0, 1, 7, 500}) {
      const auto source = read_ahead(std::make_unique<Counting>(blocks, false), ahead);
      EXPECT_EQ(source->info().format, "counting");
      PointBlock block;
      for (int i = 0; i < blocks; ++i) {
        ASSERT_TRUE(source->next(block));
        ASSERT_EQ(block.size(), 1u);
        ASSERT_EQ(block.positions[0][0], i);
        ASSERT_EQ(source->progress().points, static_cast<std::uint64_t>(i) + 1);
      }
      for (int again = 0; again < 3; ++again) {
        EXPECT_FALSE(source->next(block));
        EXPECT_TRUE(block.empty());
      }
    }
  }
}

TEST(ReadAhead, ErrorsFollowTheBlocksBeforeThem) {
  const auto source = read_ahead(std::make_unique<Counting>(5, true), 3);
  PointBlock block;
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(source->next(block));
  EXPECT_THROW(source->next(block), Error);
  EXPECT_THROW(source->next(block), Error);
}

TEST(ReadAhead, ReadsNoFurtherThanRequestedAndStopsImmediately) {
  std::atomic<int> blocks_read = 0;
  {
    const auto source = read_ahead(std::make_unique<Counting>(1 << 30, false, &blocks_read), 4);
    PointBlock block;
    ASSERT_TRUE(source->next(block));
  }
  EXPECT_LE(blocks_read, 1 + 4 + 1);
}

/// Delivers a block, then waits until it is stopped.
class Waiting final : public PointSource {
 public:
  explicit Waiting(std::stop_token stop) : stop_(std::move(stop)) {}
  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  bool next(PointBlock& block) override {
    block.clear();
    if (!delivered_) {
      delivered_ = true;
      block.positions.push_back({1, 2, 3});
      return true;
    }
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any().wait(lock, stop_, [] { return false; });
    throw Stopped();
  }
  [[nodiscard]] Progress progress() const override { return {}; }

 private:
  std::stop_token stop_;
  SourceInfo info_;
  bool delivered_ = false;
};

TEST(ReadAhead, DestructionAndTheCallersStopEndReading) {
  PointBlock block;
  {
    const std::stop_source reading;
    const auto source = read_ahead(std::make_unique<Waiting>(reading.get_token()), 4, reading);
    ASSERT_TRUE(source->next(block));
    // The thread waits or is about to wait; the destructor ends it.
  }
  std::stop_source caller;
  const std::stop_source reading;
  const auto source =
      read_ahead(std::make_unique<Waiting>(reading.get_token()), 4, reading, caller.get_token());
  ASSERT_TRUE(source->next(block));
  caller.request_stop();
  EXPECT_THROW(source->next(block), Stopped);
}

/// A named pipe, in a folder that is removed with it.
class NamedPipe {
 public:
  NamedPipe() : path_((folder_.path() / "pipe").string()) { ::mkfifo(path_.c_str(), 0600); }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  TempFolder folder_;
  std::string path_;
};

TEST(ReadAhead, StopsOpeningAPipeWithoutAWriter) {
  const NamedPipe pipe;
  const std::array<std::string, 1> files{pipe.path()};
  std::stop_source stop;
  std::jthread stopper([&stop] { stop.request_stop(); });
  EXPECT_THROW((void)open_source(files, {.stop = stop.get_token()}), Stopped);
}

TEST(ReadAhead, CanBeDestroyedWhileItsPipeIsIdle) {
  const NamedPipe pipe;
  const std::array<std::string, 1> files{pipe.path()};
  // Also open for reading, so that opening returns immediately and the pipe has a reader.
  const int writer = ::open(pipe.path().c_str(), O_RDWR | O_CLOEXEC);
  std::string lines;
  while (lines.size() < 8192) lines += "1 2 3\n";
  ASSERT_EQ(::write(writer, lines.data(), lines.size()), static_cast<ssize_t>(lines.size()));
  {
    const auto source = open_source(files, {.block_points = 100, .blocks_ahead = 1000});
    PointBlock block;
    ASSERT_TRUE(source->next(block));
    EXPECT_EQ(block.size(), 100u);
  }
  ::close(writer);
}

}  // namespace
}  // namespace terrace::stream
