// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

/// Where files and stores are written before they have their names, and how they are cleaned up if
/// the writer is killed. A file being written is `.NAME.tmp-PID` and is itself locked; a store is a
/// folder of that name with the lock file `.NAME.tmp-PID.lock` next to it. The store that it
/// replaces is briefly `.NAME.tmp-PID-old`, under the same lock.

namespace terrace::stream {

/// The file that makes a folder a store: written last, removed first.
inline constexpr const char* kManifestName = "manifest.json";
inline constexpr const char* kLockEnding = ".lock";
inline constexpr const char* kReplacedEnding = "-old";

/// The folder that contains or will contain `target`, a path that does not end in a symbolic link.
std::filesystem::path folder_of(const std::filesystem::path& target);
/// The name of this process's temporary file for `target`; `attempt` distinguishes several.
std::string temporary_name(const std::filesystem::path& target, int attempt);

/// Cleans up after dead writers of `target`: a store that was moved aside and whose name is still
/// free gets its name back, everything else is removed. Files that cannot be locked or removed
/// stay.
void sweep_temporaries(const std::filesystem::path& target);
/// Only the first part. Returns whether `target` has its store back.
bool put_back_replaced(std::filesystem::path target);

/// rename() that refuses an existing target; returns errno.
int rename_exclusively(const std::filesystem::path& from, const std::filesystem::path& to);
/// Removes the folder of a store, its manifest first: if this is interrupted, the rest is not taken
/// for a store. Never throws.
void remove_store_folder(const std::filesystem::path& folder) noexcept;

}  // namespace terrace::stream
