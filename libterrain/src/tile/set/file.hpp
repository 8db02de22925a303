// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terrace::terrain {

/// Returns the bytes of a file; empty if it does not exist. Throws: stream::Error if it cannot be
/// read.
std::vector<std::byte> read_tile_file(const std::string& path);

/// Creates the folder, writes the file as `.NAME.tmp-PID` in it and renames it. Does not sync:
/// sync_files() syncs thousands of tiles together. Throws: stream::Error; no partial file is left.
void write_tile_file(const std::string& path, std::span<const std::byte> bytes);

/// Whether a path in a tile set's folder is a file that write_tile_file() was writing when it was
/// killed.
bool is_torn_tile(std::string_view path);

/// Makes the file system of `folder` persist everything written to files. Throws: stream::Error.
void sync_files(const std::string& folder);
/// Makes it persist the names in `folder`. Throws: stream::Error.
void sync_names(const std::string& folder);

}  // namespace terrace::terrain
