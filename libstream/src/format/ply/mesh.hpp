// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "terrace/stream/mesh_reader.hpp"

namespace terrace::stream {

/// A PLY, whose vertices have attributes. Throws and returns as read_mesh() does.
std::optional<MeshFile> read_ply_mesh(const std::string& file, const SourceOptions& options);

}  // namespace terrace::stream
