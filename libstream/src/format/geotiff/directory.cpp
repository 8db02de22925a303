// SPDX-License-Identifier: Apache-2.0
#include "format/geotiff/directory.hpp"

#include <bit>
#include <cassert>
#include <limits>

#include <tiff.h>

namespace terrace::stream {
namespace {

template <class T>
void append_native(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// An offset or a number of values.
void append_size(std::string& out, bool big, std::uint64_t value) {
  if (big) {
    append_native(out, value);
  } else {
    assert(value <= std::numeric_limits<std::uint32_t>::max());
    append_native(out, static_cast<std::uint32_t>(value));
  }
}

}  // namespace

template <class T>
void TiffDirectory::add(std::uint32_t tag, std::uint16_t type, const std::vector<T>& values) {
  assert(!values.empty());
  Entry& entry = entries_[static_cast<std::uint16_t>(tag)];
  entry = {.type = type, .count = values.size(), .values = {}};
  entry.values.assign(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

void TiffDirectory::add(std::uint32_t tag, const std::vector<std::uint16_t>& values) {
  add(tag, TIFF_SHORT, values);
}
void TiffDirectory::add(std::uint32_t tag, const std::vector<std::uint32_t>& values) {
  add(tag, TIFF_LONG, values);
}
void TiffDirectory::add(std::uint32_t tag, const std::vector<std::uint64_t>& values) {
  add(tag, TIFF_LONG8, values);
}
void TiffDirectory::add(std::uint32_t tag, const std::vector<double>& values) {
  add(tag, TIFF_DOUBLE, values);
}
void TiffDirectory::add(std::uint32_t tag, const std::string& text) {
  add(tag, TIFF_ASCII, std::vector<char>(text.c_str(), text.c_str() + text.size() + 1));
}

std::string TiffDirectory::bytes(bool big, std::uint64_t at, std::uint64_t next) const {
  assert(at % 2 == 0);
  const std::size_t offset_bytes = big ? 8 : 4, count_bytes = big ? 8 : 2;
  const std::size_t entry_bytes = 4 + 2 * offset_bytes;
  std::string head, values;
  const std::uint64_t values_at = at + count_bytes + entries_.size() * entry_bytes + offset_bytes;
  if (big) {
    append_native(head, std::uint64_t{entries_.size()});
  } else {
    append_native(head, static_cast<std::uint16_t>(entries_.size()));
  }
  for (const auto& [tag, entry] : entries_) {
    append_native(head, tag);
    append_native(head, entry.type);
    append_size(head, big, entry.count);
    if (entry.values.size() <= offset_bytes) {
      head += entry.values;
      head.append(offset_bytes - entry.values.size(), '\0');
    } else {
      append_size(head, big, values_at + values.size());
      values += entry.values;
      values.append(values.size() % 2, '\0');
    }
  }
  append_size(head, big, next);
  return head + values;
}

std::string tiff_head(bool big, std::uint64_t first) {
  std::string head = std::endian::native == std::endian::little ? "II" : "MM";
  append_native(head, static_cast<std::uint16_t>(big ? 43 : 42));
  if (big) {
    append_native(head, std::uint16_t{8});
    append_native(head, std::uint16_t{0});
  }
  append_size(head, big, first);
  return head;
}

}  // namespace terrace::stream
