// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace terrace::tools {

/// The comment that marks files of formats with comments.
inline constexpr const char* kWriterMark = "written by terrace";

/// True if the regular file at `path` bears the mark of terrace: every format that terrace writes
/// with room for one names its writer near the file's begin or end. Text tables have no such room;
/// a file that holds nothing but numbers, separators and one line of names passes too.
bool written_by_terrace(const std::string& path);

/// Whether the output `path` may be written, to be asked before the work begins. Returns the
/// writers' `replace`: true if a file is there and --force says to replace it.
/// Throws: stream::Error if something is there and `force` is false, or if it is no file of ours.
bool may_replace(const std::string& path, bool force);

}  // namespace terrace::tools
