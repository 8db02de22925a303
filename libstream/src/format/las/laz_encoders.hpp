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
#include <span>
#include <thread>
#include <vector>

#include "terrace/stream/laz.hpp"

namespace terrace::stream {

/// Encodes chunks of LAZ on several threads and passes them on in their original order, on the
/// caller's thread. Holds a chunk per thread and one more, with their records and coded bytes.
class LazEncoders {
 public:
  using Write = std::function<void(std::span<const std::byte> coded)>;

  LazEncoders(const laz::Vlr& vlr, unsigned threads, Write write);
  ~LazEncoders();
  LazEncoders(const LazEncoders&) = delete;
  LazEncoders& operator=(const LazEncoders&) = delete;

  /// Queues the records of a chunk. Throws: what `write` throws, possibly for earlier chunks.
  void encode(std::span<const std::byte> records);
  /// Waits for the remaining chunks and passes them on.
  void finish();

 private:
  struct Job {
    std::vector<std::byte> records{}, coded{};
    std::exception_ptr error{};
    bool done = false;
  };

  void start();
  void run();
  /// Waits for the oldest job and passes its chunk on.
  void pass_on();

  laz::Vlr vlr_;
  unsigned wanted_threads_;
  Write write_;
  bool started_ = false;
  std::unique_ptr<laz::Encoder> own_;  ///< used if there are no threads
  std::vector<std::byte> coded_;       ///< coded by own_
  std::vector<std::unique_ptr<Job>> free_;

  std::mutex mutex_;
  std::condition_variable work_, news_;
  std::deque<std::unique_ptr<Job>> jobs_;  ///< the oldest first
  std::size_t next_ = 0;                   ///< the first job that is not yet begun
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace terrace::stream
