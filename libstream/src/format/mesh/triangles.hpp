// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "format/mesh/parser.hpp"
#include "terrace/stream/input.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// A mesh being read.
struct OpenMesh {
  std::unique_ptr<Input> input;  ///< the parser's input, unless it has its own
  std::unique_ptr<MeshParser> parser;
};

/// Returns the triangles of a mesh as described in SourceOptions::entities; polygons are split into
/// fans. Memory: 17 MiB; vertices referenced by index are kept in a temporary file, 24 bytes each.
std::unique_ptr<PointSource> triangles_of(OpenMesh mesh, const SourceOptions& options);

}  // namespace terrace::stream
