// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "format/record_parts.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/laz.hpp"

/// Reads chunks of LAZ in any order.

namespace terrace::stream {

/// The properties of a file's chunks, known before they are read.
struct LazLayout {
  laz::Vlr vlr;
  std::vector<laz::Chunk> chunks{};  ///< empty without a table
  std::uint64_t first = 0;           ///< byte of the first chunk
};

/// Returns an Error with the remedy for a damaged file.
Error laz_fault(std::string file, std::string cause);
Error chunk_fault(std::string file, std::uint64_t chunk, std::uint64_t byte, std::string cause);

/// One part per chunk of the layout. A reader holds the coded bytes of one chunk and the models of
/// a decoder.
RecordParts laz_parts(std::unique_ptr<ByteSource> file, LazLayout layout);

}  // namespace terrace::stream
