// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace terrace::stream {

/// Records written without the bytes that are the same in all of them: flags that are not used, the
/// upper bytes of coordinates and numbers.
class RecordPacker {
 public:
  explicit RecordPacker(std::size_t record_bytes) : record_bytes_(record_bytes) {}

  /// Packs complete records, at least one. The view is valid until the next call. Packed records
  /// are longer by at most two records.
  std::span<const std::byte> pack(std::span<const std::byte> records);
  /// Undoes pack(). Requires `records` to be as long as those that were packed to `packed`.
  void unpack(std::span<const std::byte> packed, std::span<std::byte> records);

 private:
  /// Bytes of a record, at most 16, that are the same in all records or written for each.
  struct Run {
    std::size_t in_record, written, bytes;
    bool same;
  };

  std::size_t find_runs(std::span<const std::byte> differing);

  std::size_t record_bytes_;
  std::vector<Run> runs_;
  std::vector<std::byte> differing_, bytes_;
};

}  // namespace terrace::stream
