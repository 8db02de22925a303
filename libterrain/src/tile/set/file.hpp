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
/// sync_files() syncs thousands of tiles together. Throws: stream::Error, and leaves no partial
/// file.
void write_tile_file(const std::string& path, std::span<const std::byte> bytes);

/// Whether a path in a tile set's folder is a temporary file that an interrupted write_tile_file()
/// left.
bool is_torn_tile(std::string_view path);

/// Syncs the contents of all files in the file system of `folder`. Throws: stream::Error.
void sync_files(const std::string& folder);
/// Syncs the names in `folder`. Throws: stream::Error.
void sync_names(const std::string& folder);

}  // namespace terrace::terrain
