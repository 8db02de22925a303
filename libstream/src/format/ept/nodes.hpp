// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "format/ept/metadata.hpp"
#include "format/las/header.hpp"
#include "format/record_parts.hpp"

namespace terrace::stream {

/// The file of a node's points.
std::filesystem::path ept_node_file(const std::filesystem::path& folder, EptData data,
                                    const OctreeNode& node);

/// One part for each node of `metadata.octree`, in its order. first: the header of one LAZ node,
/// with which all others must agree. A reader holds a window of the node's file and the memory of
/// its decoder. It refuses a file that does not have exactly as many points as the hierarchy says.
RecordParts ept_parts(const std::filesystem::path& folder, const EptMetadata& metadata,
                      const LasHeader& first);

}  // namespace terrace::stream
