// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include "terrace/stream/input.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The raw point records of a file, in their order.
class RecordReader {
 public:
  virtual ~RecordReader() = default;
  /// The next records, `wanted` or fewer, but one at least; valid until the next call. Asked only
  /// for records that the header promises, or lost() for. Empty where all that are left are lost.
  /// Throws: Error if they are not there and nobody wants to be told of damage, Stopped.
  virtual std::string_view read(std::uint64_t wanted) = 0;
  /// How many records were in damaged parts, so far (see SourceOptions::on_damage).
  [[nodiscard]] virtual std::uint64_t lost() const { return 0; }
  /// What must be in memory at once, as far as the file decides it.
  [[nodiscard]] virtual std::uint64_t held_bytes() const { return 0; }
};

/// The records of LAS, which lie in the file as they are.
class PlainRecords final : public RecordReader {
 public:
  /// points: as many as there should be.
  PlainRecords(Input& input, std::size_t record_bytes, std::uint64_t points,
               OnDamage on_damage = {})
      : input_(&input),
        record_bytes_(record_bytes),
        left_(points),
        on_damage_(std::move(on_damage)) {}
  std::string_view read(std::uint64_t wanted) override;
  [[nodiscard]] std::uint64_t lost() const override { return lost_; }

 private:
  Input* input_;
  std::size_t record_bytes_, used_ = 0;
  std::uint64_t left_, lost_ = 0;
  OnDamage on_damage_;
};

}  // namespace terrace::stream
