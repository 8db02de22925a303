// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include "terrace/stream/input.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The raw point records of a file, in order.
class RecordReader {
 public:
  virtual ~RecordReader() = default;
  /// Returns the next records, at least one and at most `max_records`; valid until the next call.
  /// Returns nothing if all remaining records are lost. The caller never asks for more than the
  /// header's count minus the records read and lost(). Throws: Error if records are missing and no
  /// handler for damage is set; Stopped on a stop request.
  virtual std::string_view read(std::uint64_t max_records) = 0;
  /// Number of records in damaged parts so far (see SourceOptions::on_damage).
  [[nodiscard]] virtual std::uint64_t lost() const { return 0; }
  /// Returns the memory in bytes that this file needs in addition to the fixed minimum.
  [[nodiscard]] virtual std::uint64_t held_bytes() const { return 0; }
};

/// Reads uncompressed records.
class PlainRecords final : public RecordReader {
 public:
  /// Reads records of `record_bytes` bytes. points: the expected number of records.
  PlainRecords(Input& input, std::size_t record_bytes, std::uint64_t points,
               OnDamage on_damage = {})
      : input_(&input),
        record_bytes_(record_bytes),
        remaining_(points),
        on_damage_(std::move(on_damage)) {}
  std::string_view read(std::uint64_t max_records) override;
  [[nodiscard]] std::uint64_t lost() const override { return lost_; }

 private:
  Input* input_;
  std::size_t record_bytes_, used_ = 0;
  std::uint64_t remaining_, lost_ = 0;
  OnDamage on_damage_;
};

}  // namespace terrace::stream
