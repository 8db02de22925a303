// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "mesh/scene.hpp"

namespace terrace::terrain {

/// Writes a mesh as the format says (empty: as the file's ending says), with its levels where it
/// has any. Throws: stream::Error.
void write_mesh(const std::string& path, const std::string& format, const TriangleMesh& mesh,
                bool replace);

}  // namespace terrace::terrain
