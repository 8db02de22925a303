// SPDX-License-Identifier: Apache-2.0
#include "format/output_columns.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>

#include <fmt/core.h>

#include "io/bytes.hpp"
#include "io/number.hpp"
#include "with_type.hpp"

namespace terrace::stream {
namespace {

bool is_axis(const std::string& name) {
  return name.size() == 1 && std::string_view("xyzXYZ").find(name[0]) != std::string_view::npos;
}

std::string word_of(const std::string& name) {
  std::string out = name.empty() ? "attribute" : name;
  for (char& c : out) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte <= 0x20 || byte == 0x7f) c = '_';
  }
  return out;
}

}  // namespace

OutputColumns::OutputColumns(std::span<const Channel> attributes) {
  for (const Channel& channel : attributes) {
    const std::string word = word_of(channel.name);
    std::string name = word;
    const auto is_taken = [&] {
      return is_axis(name) ||
             std::any_of(columns_.begin(), columns_.end(),
                         [&](const OutputColumn& column) { return column.name == name; });
    };
    for (int n = 2; is_taken(); ++n) name = fmt::format("{}_{}", word, n);
    const bool is_scaled = channel.scale != 1.0 || channel.offset != 0.0;
    columns_.push_back({.name = name,
                        .stored_type = channel.type,
                        .file_type = is_scaled ? ScalarType::f64 : channel.type,
                        .scale = channel.scale,
                        .offset = channel.offset,
                        .is_scaled = is_scaled});
    stored_bytes_ += size_of(channel.type);
    file_bytes_ += size_of(columns_.back().file_type);
  }
}

void OutputColumns::assert_matches(const PointBlock& block) const {
  assert(block.payload.size() == block.size() * stored_bytes_);
  (void)block;
}

void OutputColumns::append_text(std::string& out, const PointBlock& block, std::size_t i,
                                char separator) const {
  const std::byte* raw = block.payload.data() + i * stored_bytes_;
  for (const OutputColumn& column : columns_) {
    out += separator;
    if (column.is_scaled) {
      append_number(out, to_double(column.stored_type, raw) * column.scale + column.offset);
    } else {
      with_type(column.stored_type, [&](auto value) {
        std::memcpy(&value, raw, sizeof value);
        append_number(out, value);
      });
    }
    raw += size_of(column.stored_type);
  }
}

char* OutputColumns::put_bytes(char* at, const PointBlock& block, std::size_t i) const {
  const std::byte* raw = block.payload.data() + i * stored_bytes_;
  for (const OutputColumn& column : columns_) {
    if (column.is_scaled) {
      at = store_little_endian(at,
                               to_double(column.stored_type, raw) * column.scale + column.offset);
    } else {
      at = with_type(column.stored_type, [&](auto value) {
        std::memcpy(&value, raw, sizeof value);
        return store_little_endian(at, value);
      });
    }
    raw += size_of(column.stored_type);
  }
  return at;
}

}  // namespace terrace::stream
