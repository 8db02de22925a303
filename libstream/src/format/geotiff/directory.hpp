// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "terrace/stream/geotiff_writer.hpp"

/// Writes TIFF 6.0 and BigTIFF, which has 64-bit offsets, in the byte order of the machine.

namespace terrace::stream {

/// The tags of one image. Numbers are written with the type in which they are given: the caller
/// knows which types a tag may have.
class TiffDirectory {
 public:
  void add(std::uint32_t tag, const std::vector<std::uint16_t>& values);
  void add(std::uint32_t tag, const std::vector<std::uint32_t>& values);
  void add(std::uint32_t tag, const std::vector<std::uint64_t>& values);
  void add(std::uint32_t tag, const std::vector<double>& values);
  void add(std::uint32_t tag, const std::string& text);

  /// Returns the directory for offset `at`, which must be even, followed by its values. next:
  /// offset of the next directory, 0 after the last. The length is even and depends only on the
  /// numbers of values. Unless `big`, all offsets must fit 32 bits.
  [[nodiscard]] std::string bytes(bool big, std::uint64_t at, std::uint64_t next) const;

 private:
  struct Entry {
    std::uint16_t type = 0;
    std::uint64_t count = 0;
    std::string values;
  };
  template <class T>
  void add(std::uint32_t tag, std::uint16_t type, const std::vector<T>& values);

  std::map<std::uint16_t, Entry> entries_;  ///< in ascending order, as TIFF requires
};

/// Returns the header of a TIFF whose first directory is at offset `first`: 8 bytes, or 16 if
/// `big`.
std::string tiff_head(bool big, std::uint64_t first);

/// Returns the tags of the raster (level 0) or of an overview of that size, without those that say
/// where its tiles are.
TiffDirectory tags_of(const GeoTiffOptions& options, unsigned level, std::uint32_t columns,
                      std::uint32_t rows);

}  // namespace terrace::stream
