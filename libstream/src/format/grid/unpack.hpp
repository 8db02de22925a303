// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "terrace/stream/byte_source.hpp"

/// Unpacks files from archives. A file never unpacks to more than its stated size, which the caller
/// can check beforehand.

struct zip;

namespace terrace::stream {

/// A file in an archive.
struct PackedFile {
  std::string name{};        ///< in the archive; empty if that has no names
  std::uint64_t size = 0;    ///< unpacked, as the archive states
  std::uint64_t number = 0;  ///< among a zip archive's files
};

/// An open zip archive.
class ZipArchive {
 public:
  /// Throws: Error if the file is not a zip archive.
  explicit ZipArchive(const std::string& file);
  ~ZipArchive();
  ZipArchive(const ZipArchive&) = delete;
  ZipArchive& operator=(const ZipArchive&) = delete;

  /// The files with that ending, in lower or upper case, in the order of the archive. Throws: Error
  /// if there is none, or if one states more bytes than its packed bytes could ever unpack to.
  [[nodiscard]] std::vector<PackedFile> find(std::string_view ending) const;
  /// Unpacks a file to a temporary file. Throws: Error if it is damaged or encrypted, or if it does
  /// not have its stated size.
  [[nodiscard]] std::unique_ptr<ByteSource> unpack(const PackedFile& packed) const;

 private:
  std::string file_;
  zip* archive_ = nullptr;
};

/// The file in a gzip file with one member. Its stated size is modulo 2^32.
/// Throws: Error if it states more bytes than its packed bytes could ever unpack to.
PackedFile find_in_gzip(const std::string& file);
/// Unpacks that file. Throws: Error as ZipArchive::unpack().
std::unique_ptr<ByteSource> unpack_gzip(const std::string& file, const PackedFile& packed);

}  // namespace terrace::stream
