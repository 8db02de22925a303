// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace terrace::stream {

/// Packs records without the bytes that are the same in all of them, such as unused flags and the
/// upper bytes of coordinates and numbers.
class RecordPacker {
 public:
  explicit RecordPacker(std::size_t record_bytes) : record_bytes_(record_bytes) {}

  /// Packs one or more complete records. The result is valid until the next call, and is longer
  /// than `records` by at most two records.
  std::span<const std::byte> pack(std::span<const std::byte> records);
  /// Undoes pack(). Requires that `records` has the size of the records that were packed.
  void unpack(std::span<const std::byte> packed, std::span<std::byte> records);

 private:
  /// At most 16 bytes of a record that are either the same in all records or written for each.
  struct Run {
    std::size_t record_offset, packed_offset, bytes;
    bool same;
  };

  std::size_t find_runs(std::span<const std::byte> differing);

  std::size_t record_bytes_;
  std::vector<Run> runs_;
  std::vector<std::byte> differing_, bytes_;
};

}  // namespace terrace::stream
