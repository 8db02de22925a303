// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terrace::terrain {

/// The bytes of a file; empty if there is none. Throws: stream::Error if it cannot be read.
std::vector<std::byte> read_tile_file(const std::string& path);

/// Writes a file as `.NAME.tmp-PID` beside its name and renames it, its folder made first. Not
/// synced: thousands of tiles are synced together by sync_files(). Throws: stream::Error; nothing
/// partial stays.
void write_tile_file(const std::string& path, std::span<const std::byte> bytes);

/// Whether a file of a tile set, by its path in the folder, is one that write_tile_file() was
/// writing when it was killed.
bool is_torn_tile(std::string_view path);

/// Has the file system of `folder` keep all that was written to files. Throws: stream::Error.
void sync_files(const std::string& folder);
/// Has it keep which names are in `folder`. Throws: stream::Error.
void sync_names(const std::string& folder);

}  // namespace terrace::terrain
