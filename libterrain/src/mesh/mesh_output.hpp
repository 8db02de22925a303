// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <terrace/stream/point_writer.hpp>

#include "mesh/scene.hpp"

namespace terrace::terrain {

/// Writes a mesh, with its levels where it has any. Throws: stream::Error, stream::Stopped.
void write_mesh(const std::string& path, const TriangleMesh& mesh,
                const stream::WriterOptions& options);

}  // namespace terrace::terrain
