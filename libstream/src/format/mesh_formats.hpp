// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "terrace/stream/mesh_reader.hpp"

/// What read_mesh() chooses from, each in the file of its format.

namespace terrace::stream {

/// Throw and return as read_mesh() does.
std::optional<MeshFile> read_ply_mesh(const std::string& file, const SourceOptions& options);
std::optional<MeshFile> read_obj_mesh(const std::string& file, const SourceOptions& options);

}  // namespace terrace::stream
