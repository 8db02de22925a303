// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// A source read to its end.
struct AllPoints {
  SourceInfo info;
  PointBlock points;
  std::size_t largest_block = 0;

  /// Values of an attribute, whose type is T.
  template <class T>
  [[nodiscard]] AttributeView<T> values(std::size_t attribute) const {
    return info.view<T>(points.payload, attribute);
  }
};

inline AllPoints read_all(PointSource& source) {
  AllPoints all;
  all.info = source.info();
  PointBlock block;
  while (source.next(block)) {
    all.largest_block = std::max(all.largest_block, block.size());
    all.points.positions.insert(all.points.positions.end(), block.positions.begin(),
                                block.positions.end());
    all.points.payload.insert(all.points.payload.end(), block.payload.begin(), block.payload.end());
  }
  return all;
}

inline AllPoints read_all(const std::vector<std::string>& files,
                          const SourceOptions& options = {}) {
  return read_all(*open_source(files, options));
}

inline AllPoints read_file(const std::filesystem::path& file, const SourceOptions& options = {}) {
  return read_all(std::vector<std::string>{file.string()}, options);
}

inline std::string write_text(const std::filesystem::path& path, std::string_view text) {
  std::ofstream file(path, std::ios::binary);
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  return path.string();
}

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Returns the message of the Error thrown by `act`; empty if there is none.
template <class Act>
std::string error_of(Act&& act) {
  try {
    act();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

/// True if equal bit for bit, which distinguishes 0 from -0.
inline bool same_bits(std::span<const Point3> a, std::span<const Point3> b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}

/// Returns a double of any finite bit pattern, or one with few decimals, as people write them.
inline double any_double(std::mt19937_64& random) {
  switch (random() % 4) {
    case 0:
      for (;;) {
        const double value = std::bit_cast<double>(random());
        if (value - value == 0.0) return value;
      }
    case 1:
      return static_cast<double>(static_cast<std::int64_t>(random() % 2000001) - 1000000) / 1000.0;
    case 2:
      return static_cast<double>(static_cast<std::int64_t>(random() % 7) - 3) * 0.0;
    default:
      return 4.5e6 + static_cast<double>(random() >> 11) * 0x1p-53;
  }
}

/// Appends values to packed records, one after the other.
template <class... T>
void append_values(std::vector<std::byte>& payload, const T&... values) {
  const auto append = [&payload](const auto& value) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    payload.insert(payload.end(), bytes.begin(), bytes.end());
  };
  (append(values), ...);
}

/// Appends a random value of that type: any bits, but finite for floats and doubles.
inline void append_any(std::vector<std::byte>& payload, ScalarType type, std::mt19937_64& random) {
  if (type == ScalarType::f64) return append_values(payload, any_double(random));
  if (type == ScalarType::f32) {
    return append_values(payload, static_cast<float>(random() % 100000) / 7.0f);
  }
  const std::uint64_t bits = random();
  const auto bytes = std::as_bytes(std::span(&bits, 1)).first(size_of(type));
  payload.insert(payload.end(), bytes.begin(), bytes.end());
}

}  // namespace terrace::stream
