// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>

namespace terrace::tools {

/// Runs long work of a library on points in memory, so that Ctrl-C ends it (run_interruptible()),
/// and names the file in what it throws: std::invalid_argument and std::bad_alloc become
/// stream::Error.
void call_library(const std::string& file, const std::string& method,
                  const std::function<void()>& work);

}  // namespace terrace::tools
