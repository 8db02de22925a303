// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "point_files.hpp"

namespace terrace::stream {

template <class T>
void put(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

/// The bytes of a LAS file, made of parts that need not be consistent.
struct LasParts {
  unsigned point_format = 1, minor = 2;
  std::size_t record_bytes = 28;
  std::uint64_t points = 0;
  std::string records{}, vlrs{};
  std::uint32_t vlr_count = 0;
  std::uint16_t encoding = 0;
  Point3 scale{0.01, 0.01, 0.01}, offset{};
  Box3 bounds{.min = {}, .max = {}};

  void add_vlr(std::string_view user, std::uint16_t id, std::string_view data) {
    std::string head(54, '\0');
    std::copy(user.begin(), user.end(), head.begin() + 2);
    put(head, 18, id);
    put(head, 20, static_cast<std::uint16_t>(data.size()));
    vlrs.append(head).append(data);
    ++vlr_count;
  }
  [[nodiscard]] std::string bytes() const {
    const std::size_t header_bytes = minor == 4 ? 375 : minor == 3 ? 235 : 227;
    std::string out(header_bytes, '\0');
    out.replace(0, 4, "LASF");
    put(out, 6, encoding);
    out[24] = 1;
    out[25] = static_cast<char>(minor);
    put(out, 94, static_cast<std::uint16_t>(header_bytes));
    put(out, 96, static_cast<std::uint32_t>(header_bytes + vlrs.size()));
    put(out, 100, vlr_count);
    out[104] = static_cast<char>(point_format);
    put(out, 105, static_cast<std::uint16_t>(record_bytes));
    put(out, 107, static_cast<std::uint32_t>(points));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      put(out, 131 + 8 * axis, scale[axis]);
      put(out, 155 + 8 * axis, offset[axis]);
      put(out, 179 + 16 * axis, bounds.max[axis]);
      put(out, 187 + 16 * axis, bounds.min[axis]);
    }
    if (minor == 4) put(out, 247, points);
    return out + vlrs + records;
  }
};

/// Returns the point records of a LAS file.
inline std::string records_of(const std::filesystem::path& file) {
  const std::string bytes = read_text(file);
  std::uint32_t offset = 0, old_points = 0;
  std::uint16_t record_bytes = 0;
  std::uint64_t points = 0;
  std::memcpy(&offset, bytes.data() + 96, 4);
  std::memcpy(&record_bytes, bytes.data() + 105, 2);
  std::memcpy(&old_points, bytes.data() + 107, 4);
  if (bytes[25] == 4) std::memcpy(&points, bytes.data() + 247, 8);
  if (points == 0) points = old_points;
  return bytes.substr(offset, points * record_bytes);
}

}  // namespace terrace::stream
