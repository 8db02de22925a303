// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace terrace::tools {

/// The bytes of a file; empty if there is none. Throws: stream::Error if it cannot be read.
std::vector<std::byte> read_tile_file(const std::string& path);

/// Writes a file beside its name and renames it, its folder made first. Not synced: thousands of
/// tiles are synced together by sync_folder(). Throws: stream::Error; nothing partial stays.
void write_tile_file(const std::string& path, std::span<const std::byte> bytes);

/// Has the file system of `folder` keep all that was written. Throws: stream::Error.
void sync_folder(const std::string& folder);

}  // namespace terrace::tools
