// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "terrace/stream/byte_source.hpp"

/// Files out of archives. Nothing is unpacked but to its stated size, which the caller may
/// judge beforehand.

struct zip;

namespace terrace::stream {

/// A file in an archive.
struct PackedFile {
  std::string name{};        ///< in the archive; empty where that has none
  std::uint64_t size = 0;    ///< unpacked, as the archive states
  std::uint64_t number = 0;  ///< of a zip archive's files
};

/// A zip archive, open.
class ZipArchive {
 public:
  /// Throws: Error if it is none.
  explicit ZipArchive(const std::string& file);
  ~ZipArchive();
  ZipArchive(const ZipArchive&) = delete;
  ZipArchive& operator=(const ZipArchive&) = delete;

  /// The files whose names have that ending, in any case, in the order of the archive.
  /// Throws: Error if there is none, or if one states more bytes than those packed could ever
  /// unpack to.
  [[nodiscard]] std::vector<PackedFile> find(std::string_view ending) const;
  /// The bytes of one, in a temporary file. Throws: Error if they are damaged, encrypted, or not as
  /// many as stated.
  [[nodiscard]] std::unique_ptr<ByteSource> unpack(const PackedFile& packed) const;

 private:
  std::string file_;
  zip* archive_ = nullptr;
};

/// The file in a gzip file of one member. The size that it states is modulo 2^32.
/// Throws: Error if it states more bytes than those packed could ever unpack to.
PackedFile find_in_gzip(const std::string& file);
/// Its bytes. Throws: Error as ZipArchive::unpack().
std::unique_ptr<ByteSource> unpack_gzip(const std::string& file, const PackedFile& packed);

}  // namespace terrace::stream
