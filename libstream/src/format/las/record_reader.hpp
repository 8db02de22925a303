// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "terrace/stream/input.hpp"

namespace terrace::stream {

/// The raw point records of a file, in their order.
class RecordReader {
 public:
  virtual ~RecordReader() = default;
  /// The next records, `wanted` or fewer, but one at least; valid until the next call. Asked only
  /// for records that the header promises. Throws: Error if they are not there, Stopped.
  virtual std::string_view read(std::uint64_t wanted) = 0;
  /// What must be in memory at once, as far as the file decides it.
  [[nodiscard]] virtual std::uint64_t held_bytes() const { return 0; }
};

/// The records of LAS, which lie in the file as they are.
class PlainRecords final : public RecordReader {
 public:
  PlainRecords(Input& input, std::size_t record_bytes)
      : input_(&input), record_bytes_(record_bytes) {}
  std::string_view read(std::uint64_t wanted) override;

 private:
  Input* input_;
  std::size_t record_bytes_, used_ = 0;
};

}  // namespace terrace::stream
