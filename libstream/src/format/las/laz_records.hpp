// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "format/copc/hierarchy.hpp"
#include "format/las/header.hpp"
#include "format/las/record_reader.hpp"
#include "format/record_parts.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/input.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The records of a LAZ file. input: at the first byte after the header and VLRs. Chunks of a file
/// with a chunk table are decoded ahead by options.threads concurrently; from a pipe, without a
/// table, and if chunks are too large for that, one after the other. Throws: Error naming chunk and
/// byte for damage, and if the layout cannot be read from a pipe.
std::unique_ptr<RecordReader> open_laz_records(Input& input, const std::string& file,
                                               const LasHeader& header,
                                               const SourceOptions& options);

/// The parts that are the octree's nodes, in its order. Throws: Error as open_laz_records().
RecordParts laz_node_parts(std::unique_ptr<ByteSource> file, const LasHeader& header,
                           const Octree& octree);

}  // namespace terrace::stream
