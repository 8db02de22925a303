// SPDX-License-Identifier: Apache-2.0
#include "format/las/record_reader.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "terrace/stream/error.hpp"

namespace terrace::stream {

std::string_view PlainRecords::read(std::uint64_t max_records) {
  /// Bytes read at once: few, because each field makes a pass over them, so they must stay in
  /// cache.
  constexpr std::size_t kPieceBytes = 64u << 10;
  input_->consume(std::exchange(used_, 0));
  if (remaining_ == 0) return {};
  auto records =
      std::min<std::uint64_t>(max_records, std::max<std::size_t>(1, kPieceBytes / record_bytes_));
  const std::string_view window = input_->fill(static_cast<std::size_t>(records) * record_bytes_);
  if (window.size() < records * record_bytes_) {
    const Error damage =
        Error(input_->name(), "the file ends before the points that its header promises")
            .at_byte(input_->offset() + window.size())
            .remedy("the file is truncated or its header is wrong: download it again");
    if (!on_damage_) throw damage;
    records = window.size() / record_bytes_;
    if (records == 0) {
      lost_ = std::exchange(remaining_, 0);
      on_damage_(damage, lost_);
      return {};
    }
  }
  remaining_ -= records;
  used_ = static_cast<std::size_t>(records) * record_bytes_;
  return window.substr(0, used_);
}

}  // namespace terrace::stream
