// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "format/octree.hpp"
#include "terrace/stream/byte_source.hpp"

/// COPC 1.0 (Cloud Optimized Point Cloud, copc.io): a LAZ file of LAS 1.4 in which every chunk is a
/// node of an octree.

namespace terrace::stream {

/// The VLR that marks COPC, the first of the file, and the EVLR of its nodes.
inline constexpr std::string_view kCopcUser = "copc";
inline constexpr std::uint16_t kCopcInfo = 1, kCopcHierarchy = 1000;
/// Sizes of the info and of a node's entry in the hierarchy.
inline constexpr std::size_t kCopcInfoBytes = 160, kCopcEntryBytes = 32;

/// Reads the whole hierarchy. info: the payload of the info VLR. first_chunk: offset of the first
/// chunk in the file. points: the number in the header. Memory: 56 bytes per node. Throws: Error
/// unless pages and nodes are inside the file, no page is referred to twice, no two nodes have the
/// same key or share bytes, and the nodes have exactly that many points.
Octree read_copc_hierarchy(const ByteSource& file, std::string_view info, std::uint64_t first_chunk,
                           std::uint64_t points);

/// Nodes per page; its 16 KiB take one request.
inline constexpr std::size_t kCopcPageNodes = 512;

/// The hierarchy as the payload of its EVLR; the first root_bytes are its root page.
struct CopcHierarchy {
  std::string bytes{};
  std::uint64_t root_bytes = 0;
};

/// Writes one page if there are at most `page_nodes` nodes. Otherwise each of the largest subtrees
/// with at most that many nodes gets a page after the root page, which keeps small subtrees. Nodes
/// without points are written for the sake of their children. octree: includes all ancestors of its
/// nodes, in the order of precedes(). at: offset of the payload in the file.
CopcHierarchy write_copc_hierarchy(const Octree& octree, std::uint64_t at,
                                   std::size_t page_nodes = kCopcPageNodes);

}  // namespace terrace::stream
