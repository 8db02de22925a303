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

/// Reads the records of a LAZ file. input: at the first byte after the header and VLRs. In a file
/// with a chunk table, up to options.threads threads decode chunks ahead. From a pipe, without a
/// table, or if chunks are too large for that, chunks are decoded one after the other. Throws:
/// Error naming chunk and byte for damage, and if the layout cannot be read from a pipe.
std::unique_ptr<RecordReader> open_laz_records(Input& input, const std::string& file,
                                               const LasHeader& header,
                                               const SourceOptions& options);

/// One part per node of the octree, in its order. Throws: Error as open_laz_records().
RecordParts laz_node_parts(std::unique_ptr<ByteSource> file, const LasHeader& header,
                           const Octree& octree);

}  // namespace terrace::stream
