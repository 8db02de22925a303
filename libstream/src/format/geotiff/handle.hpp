// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <tiffio.h>

#include "terrace/stream/error.hpp"

namespace terrace::stream {

/// A TIFF file opened for reading by libtiff, without memory mapping and without output on standard
/// error, with bounded allocations. It is positioned at the first directory that is not an overview
/// or a mask.
class GeoTiffHandle {
 public:
  /// `memory_bytes`: limit of a single allocation by libtiff for decoding.
  /// Throws: Error if the file cannot be opened or its directory cannot be read.
  GeoTiffHandle(const std::string& file, std::uint64_t memory_bytes);
  ~GeoTiffHandle();
  GeoTiffHandle(const GeoTiffHandle&) = delete;
  GeoTiffHandle& operator=(const GeoTiffHandle&) = delete;

  [[nodiscard]] TIFF* tiff() const { return tiff_; }
  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] std::uint64_t file_bytes() const { return file_bytes_; }
  /// Moves on to the transparency mask of the image. Returns false if it has none.
  [[nodiscard]] bool go_to_mask();
  /// libtiff's warnings: fields it ignored because they are damaged.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

  /// Reads exactly `out.size()` bytes at `offset`; false if the file has fewer. Throws: Error if
  /// reading fails.
  [[nodiscard]] bool read(std::uint64_t offset, std::span<std::byte> out) const;
  /// Returns and forgets libtiff's last error message. Empty if there is none.
  std::string take_complaint();

  /// Values of a GeoTIFF or GDAL field; empty if it does not exist. Throws: Error if it has another
  /// type.
  [[nodiscard]] std::vector<double> doubles(std::uint32_t tag) const;
  [[nodiscard]] std::vector<std::uint16_t> shorts(std::uint32_t tag) const;
  [[nodiscard]] std::string text(std::uint32_t tag) const;
  /// Returns a scalar field, or its default value according to the TIFF specification.
  template <class T>
  [[nodiscard]] T value_or(std::uint32_t tag, T otherwise) const {
    T value = otherwise;
    return TIFFGetFieldDefaulted(tiff_, tag, &value) == 1 ? value : otherwise;
  }
  template <class T>
  [[nodiscard]] std::optional<T> value(std::uint32_t tag) const {
    T found{};
    if (TIFFGetField(tiff_, tag, &found) != 1) return std::nullopt;
    return found;
  }

  [[nodiscard]] Error fault(std::string cause) const { return {file_, std::move(cause)}; }

 private:
  struct Io;
  [[nodiscard]] std::span<const std::byte> field(std::uint32_t tag, int type) const;
  static int on_error(TIFF*, void* self, const char* module, const char* format, va_list values);
  static int on_warning(TIFF*, void* self, const char* module, const char* format, va_list values);

  std::string file_;
  std::uint64_t file_bytes_ = 0;
  std::unique_ptr<Io> io_;
  std::string complaint_;
  std::vector<std::string> warnings_;
  TIFF* tiff_ = nullptr;
};

}  // namespace terrace::stream
