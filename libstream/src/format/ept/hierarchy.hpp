// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "format/octree.hpp"

namespace terrace::stream {

/// Reads all files of ept-hierarchy/ that are reachable from the root's file. points: the number in
/// ept.json. Memory: 56 bytes per node. Throws: Error unless the files exist, each is referenced
/// once, their entries are nodes of an octree, and these have exactly that many points.
std::vector<OctreeNode> read_ept_hierarchy(const std::filesystem::path& folder,
                                           std::uint64_t points);

}  // namespace terrace::stream
