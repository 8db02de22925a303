// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The name of a type in the header of a PLY file: the old names, which every reader supports. PLY
/// has no names for 64-bit integers; we write "int64" and "uint64".
std::string ply_type_name(ScalarType type);

/// "ply", the format and the comments: the first lines of a header.
std::string ply_preamble(bool ascii, std::span<const std::string> comments);

}  // namespace terrace::stream
