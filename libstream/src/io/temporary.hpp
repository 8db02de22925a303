// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

/// Temporary names of files and folders that are being written, and the removal of those of killed
/// writers. A file being written is `.NAME.tmp-PID` and is itself locked; a folder has
/// that name and the lock file `.NAME.tmp-PID.lock` next to it. The replaced output gets the
/// temporary name in exchange, or is briefly `.NAME.tmp-PID-old` under the same lock.

namespace terrace::stream {

/// The file that makes a folder a store: written last, removed first.
inline constexpr const char* kManifestName = "manifest.json";
inline constexpr const char* kLockEnding = ".lock";
inline constexpr const char* kReplacedEnding = "-old";

/// Returns the folder that contains or will contain `target`, a path that does not end in a
/// symbolic link.
std::filesystem::path folder_of(const std::filesystem::path& target);
/// Returns the name of this process's temporary file for `target`; `attempt` distinguishes several.
std::string temporary_name(const std::filesystem::path& target, int attempt);

/// Cleans up after dead writers of `target`: a folder that was moved aside and whose name is still
/// free gets its name back, everything else is removed. Files that cannot be locked or removed
/// stay. mark: the file that makes a folder complete.
void sweep_temporaries(const std::filesystem::path& target,
                       const std::string& mark = kManifestName);
/// Restores the name of a store that a dead writer moved aside, and removes nothing. Returns
/// whether it did.
bool restore_replaced(std::filesystem::path target);

/// rename() that refuses an existing target; returns errno.
int rename_exclusively(const std::filesystem::path& from, const std::filesystem::path& to);
/// Removes a folder, its mark first: if this is interrupted, the rest is not taken for complete.
/// Needs one descriptor at a time. Never throws.
void remove_marked_folder(const std::filesystem::path& folder, const std::string& mark) noexcept;

}  // namespace terrace::stream
