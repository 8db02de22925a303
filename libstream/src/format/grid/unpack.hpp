// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "terrace/stream/byte_source.hpp"

/// Single files out of archives. Nothing is unpacked but to its stated size, which the caller may
/// judge beforehand.

namespace terrace::stream {

/// A file in an archive.
struct PackedFile {
  std::string name{};        ///< in the archive; empty where that has none
  std::uint64_t size = 0;    ///< unpacked, as the archive states
  std::uint64_t number = 0;  ///< of a zip archive's files
};

/// The only file of a zip archive whose name has that ending, in any case.
/// Throws: Error if there is none or more than one, or if it states more bytes than those packed
/// could ever unpack to.
PackedFile find_in_zip(const std::string& file, std::string_view ending);
/// Its bytes, in a temporary file. Throws: Error if they are damaged, encrypted, or not as many as
/// stated.
std::unique_ptr<ByteSource> unpack_from_zip(const std::string& file, const PackedFile& packed);

/// The file in a gzip file of one member. The size that it states is modulo 2^32.
/// Throws: Error as find_in_zip().
PackedFile find_in_gzip(const std::string& file);
/// Its bytes. Throws: Error as unpack_from_zip().
std::unique_ptr<ByteSource> unpack_gzip(const std::string& file, const PackedFile& packed);

}  // namespace terrace::stream
