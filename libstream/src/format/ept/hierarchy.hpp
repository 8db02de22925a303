// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "format/octree.hpp"

namespace terrace::stream {

/// Reads all files of ept-hierarchy/ that the root's refers to. points: how many ept.json promises.
/// Memory: 56 bytes per node. Throws: Error unless the files are there, each is referred to once,
/// their entries are nodes of an octree, and these have exactly so many points.
std::vector<OctreeNode> read_ept_hierarchy(const std::filesystem::path& folder,
                                           std::uint64_t points);

}  // namespace terrace::stream
