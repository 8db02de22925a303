// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "format/octree.hpp"
#include "format/record_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/schema.hpp"

/// EPT (Entwine Point Tile 1.0, entwine.io): a folder with ept.json, the nodes of an octree as
/// files in ept-data/ and their points counted in ept-hierarchy/.

namespace terrace::stream {

/// The file that identifies a folder as EPT.
inline constexpr const char* kEptName = "ept.json";

/// The encoding of the points in a node's file.
enum class EptData : std::uint8_t {
  laszip,    ///< a LAZ file, whose header overrides the schema
  binary,    ///< records of the schema
  zstandard  ///< the same, compressed
};

/// The contents of ept.json.
struct EptMetadata {
  EptData data = EptData::binary;
  std::uint64_t points = 0;
  Octree octree;        ///< without nodes
  RecordStream stream;  ///< from the schema: coordinates, attributes and their positions
  Crs crs;
};

/// Returns an Error with the remedy for a damaged data set.
Error ept_fault(std::string file, std::string cause);

/// Reads ept.json. Attributes that LAS also has get the names that we use for LAS. Throws: Error
/// unless the file has version 1 and X, Y and Z of known types.
EptMetadata read_ept_metadata(const std::string& file);

/// Reads all files of ept-hierarchy/ that are reachable from the root's file. points: the number in
/// ept.json. Memory: 56 bytes per node. Throws: Error unless the files exist, each is referenced
/// once, their entries are nodes of an octree, and these have exactly that many points.
std::vector<OctreeNode> read_ept_hierarchy(const std::filesystem::path& folder,
                                           std::uint64_t points);

}  // namespace terrace::stream
