// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

/// TIFF 6.0, and BigTIFF, whose offsets have 64 bits; in the byte order of the machine.

namespace terrace::stream {

/// The tags of one image. Numbers are written as they are given: the caller knows which types a tag
/// may have.
class TiffDirectory {
 public:
  void add(std::uint32_t tag, const std::vector<std::uint16_t>& values);
  void add(std::uint32_t tag, const std::vector<std::uint32_t>& values);
  void add(std::uint32_t tag, const std::vector<std::uint64_t>& values);
  void add(std::uint32_t tag, const std::vector<double>& values);
  void add(std::uint32_t tag, const std::string& text);

  /// The directory for offset `at`, an even number, with its values behind it; `next`: where the
  /// next one begins, 0 behind the last. Its length, which is even, depends on the numbers of
  /// values alone. Of a TIFF that is not big all offsets must fit 32 bits.
  [[nodiscard]] std::string bytes(bool big, std::uint64_t at, std::uint64_t next) const;

 private:
  struct Entry {
    std::uint16_t type = 0;
    std::uint64_t count = 0;
    std::string values;
  };
  template <class T>
  void add(std::uint32_t tag, std::uint16_t type, const std::vector<T>& values);

  std::map<std::uint16_t, Entry> entries_;  ///< in ascending order, as they have to be
};

/// The first bytes of a TIFF whose first directory begins at `first`: 8, or 16 of a big one.
std::string tiff_head(bool big, std::uint64_t first);

}  // namespace terrace::stream
