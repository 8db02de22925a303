// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include <terrace/stream/mesh_writer.hpp>

namespace terrace::terrain {

/// What is to be meshed to so that a reader of the file sees no more than the bound: heights move
/// by what they are rounded by, and a little with the places. path: named in errors.
/// Throws: stream::Error if the file's format rounds too coarsely for that.
double aim_within(double bound, const stream::MeshRounding& rounding, const std::string& path);

}  // namespace terrace::terrain
