// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "format/octree.hpp"
#include "format/record_source.hpp"
#include "terrace/stream/schema.hpp"

/// EPT (Entwine Point Tile 1.0, entwine.io): a folder with ept.json, the nodes of an octree as
/// files in ept-data/ and their points counted in ept-hierarchy/.

namespace terrace::stream {

/// The file that makes a folder EPT.
inline constexpr const char* kEptName = "ept.json";

/// How a node's file has its points.
enum class EptData : std::uint8_t {
  laszip,    ///< a LAZ file, whose header counts, not the schema
  binary,    ///< records of the schema
  zstandard  ///< the same, compressed
};

struct EptMetadata {
  EptData data = EptData::binary;
  std::uint64_t points = 0;
  Octree octree;        ///< without nodes
  RecordStream stream;  ///< as the schema has it: coordinates, attributes, where they lie
  Crs crs;
};

/// Throws the Error of a damaged data set.
[[noreturn]] void fail_ept(const std::string& file, std::string where, std::string cause);

/// Reads ept.json. Attributes that LAS has too are named as there. Throws: Error unless it is one
/// of version 1, with X, Y and Z of types that are known.
EptMetadata read_ept_metadata(const std::string& file);

}  // namespace terrace::stream
