// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

/// Where files and stores are written before they have their names, and what becomes of that when
/// the writer is killed. A file being written is `.NAME.tmp-PID` and locked itself; a store is a
/// folder of that name with the lock file `.NAME.tmp-PID.lock` beside it. The store that it
/// replaces is for a moment `.NAME.tmp-PID-old`, under the same lock.

namespace terrace::stream {

/// The file that makes a folder a store: written last, removed first.
inline constexpr const char* kManifestName = "manifest.json";
inline constexpr const char* kLockEnding = ".lock";
inline constexpr const char* kReplacedEnding = "-old";

/// The folder that `target`, a path without links at its end, is or will be in.
std::filesystem::path folder_of(const std::filesystem::path& target);
/// The name of this process's temporary beside `target`; `attempt` tells several apart.
std::string temporary_name(const std::filesystem::path& target, int attempt);

/// What the writers of `target` that died have left beside it: a store that was moved aside and
/// whose name is still free gets its name back, all else is removed. What cannot be locked or
/// removed stays.
void sweep_temporaries(const std::filesystem::path& target);
/// Only the first part. True if `target` has its store back.
bool put_back_replaced(std::filesystem::path target);

/// rename() that refuses an existing target; returns errno.
int rename_exclusively(const std::filesystem::path& from, const std::filesystem::path& to);
/// Removes the folder of a store, its manifest first: what is left of it if this is cut short will
/// not be taken for a store. Never throws.
void remove_store_folder(const std::filesystem::path& folder) noexcept;

}  // namespace terrace::stream
