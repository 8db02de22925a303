// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "terrace/stream/mesh_reader.hpp"

namespace terrace::stream {

/// Like read_mesh() for PLY, whose vertices may have attributes.
std::optional<MeshFile> read_ply_mesh(const std::string& file, const SourceOptions& options);

}  // namespace terrace::stream
