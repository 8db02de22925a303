// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "terrace/stream/raster.hpp"

namespace terrace::stream {

/// A complete raster in memory; cells without data hold `value` 0 and `valid` 0.
struct WholeRaster {
  RasterInfo info;
  std::vector<std::byte> samples;
  std::vector<std::uint8_t> valid;

  [[nodiscard]] std::size_t cells() const { return valid.size(); }
  template <class T>
  [[nodiscard]] T as(std::size_t cell) const {
    T value;
    std::memcpy(&value, samples.data() + cell * sizeof(T), sizeof(T));
    return value;
  }
  /// Returns a sample of any type as a double.
  [[nodiscard]] double value(std::size_t cell) const {
    switch (info.sample.type) {
      case ScalarType::i8:
        return as<std::int8_t>(cell);
      case ScalarType::u8:
        return as<std::uint8_t>(cell);
      case ScalarType::i16:
        return as<std::int16_t>(cell);
      case ScalarType::u16:
        return as<std::uint16_t>(cell);
      case ScalarType::i32:
        return as<std::int32_t>(cell);
      case ScalarType::u32:
        return as<std::uint32_t>(cell);
      case ScalarType::i64:
        return static_cast<double>(as<std::int64_t>(cell));
      case ScalarType::u64:
        return static_cast<double>(as<std::uint64_t>(cell));
      case ScalarType::f32:
        return static_cast<double>(as<float>(cell));
      case ScalarType::f64:
        break;
    }
    return as<double>(cell);
  }
};

inline WholeRaster read_whole(Raster& raster) {
  WholeRaster whole;
  whole.info = raster.info();
  const std::size_t cells = whole.info.columns * whole.info.rows;
  whole.samples.resize(cells * size_of(whole.info.sample.type));
  whole.valid.resize(cells);
  raster.read_over({0, 0, whole.info.columns, whole.info.rows},
                   {whole.samples.data(), whole.valid.data(), whole.info.columns});
  return whole;
}

/// Returns the folder of real files, if the environment names one.
inline std::optional<std::filesystem::path> real_data() {
  const char* folder = std::getenv("TERRACE_DATA");
  if (folder == nullptr || *folder == '\0') return std::nullopt;
  return folder;
}

}  // namespace terrace::stream
