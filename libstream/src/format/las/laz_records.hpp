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

/// Reads the records of a LAZ file. input: positioned after the header and VLRs. In a file with a
/// chunk table, up to options.threads threads decode chunks ahead. Without a chunk table, from a
/// pipe, or if chunks do not fit into memory, decodes one chunk after the other. Throws: Error for
/// damage, naming chunk and byte, and for a pipe whose layout needs random access.
std::unique_ptr<RecordReader> open_laz_records(Input& input, const std::string& file,
                                               const LasHeader& header,
                                               const SourceOptions& options);

/// Returns one part per node of the octree, in the octree's order. Throws: Error as
/// open_laz_records().
RecordParts copc_node_parts(std::unique_ptr<ByteSource> file, const LasHeader& header,
                            const Octree& octree);

}  // namespace terrace::stream
