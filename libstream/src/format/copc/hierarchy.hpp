// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "format/octree.hpp"
#include "terrace/stream/byte_source.hpp"

/// COPC 1.0 (Cloud Optimized Point Cloud, copc.io): a LAZ file of LAS 1.4 in which every chunk is a
/// node of an octree.

namespace terrace::stream {

/// The VLR that marks COPC, the first of the file, and the EVLR of its nodes.
inline constexpr std::string_view kCopcUser = "copc";
inline constexpr std::uint16_t kCopcInfo = 1, kCopcHierarchy = 1000;
/// Bytes of the info, and of a node's entry in the hierarchy.
inline constexpr std::size_t kCopcInfoBytes = 160, kCopcEntryBytes = 32;

/// Reads the whole hierarchy. info: the payload of the info VLR; first_chunk: where the first chunk
/// of the file begins; points: how many its header promises. Memory: 56 bytes per node.
/// Throws: Error unless pages and nodes lie in the file, no page is referred to twice, no two nodes
/// have the same key or bytes, and the nodes have exactly these points.
Octree read_copc_hierarchy(const ByteSource& file, std::string_view info, std::uint64_t first_chunk,
                           std::uint64_t points);

}  // namespace terrace::stream
