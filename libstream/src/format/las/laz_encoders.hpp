// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <terrace/base/work_ahead.hpp>

#include "terrace/stream/laz.hpp"

namespace terrace::stream {

/// Encodes chunks of LAZ on several threads and passes them on in their original order, on the
/// caller's thread. Holds a chunk per thread and one more, with their records and coded bytes.
class LazEncoders {
 public:
  using Write = std::function<void(std::span<const std::byte> coded)>;

  LazEncoders(const laz::Vlr& vlr, unsigned threads, Write write);

  /// Queues the records of a chunk. Throws: what `write` throws, possibly for earlier chunks.
  void encode(std::span<const std::byte> records);
  /// Waits for the remaining chunks and passes them on.
  void finish();

 private:
  struct Chunk {
    std::vector<std::byte> records{}, coded{};
  };

  /// Waits for the oldest chunk and passes it on.
  void deliver_oldest();

  Write write_;
  std::optional<laz::Encoder> encoder_;  ///< with one thread, which needs no copy of the records
  std::vector<std::byte> coded_;         ///< by encoder_
  std::vector<Chunk> free_chunks_;       ///< their buffers are used again
  base::WorkAhead<Chunk> queue_;
};

}  // namespace terrace::stream
