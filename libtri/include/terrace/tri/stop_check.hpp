// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace terrace::tri {

/// Called at intervals in the middle of long work, by any of its threads, several at once. What it
/// throws ends the work and reaches the caller. At most a few milliseconds pass between two calls,
/// and often less than a microsecond, so a check should only read a flag. It does not change
/// results.
using StopCheck = std::function<void()>;

}  // namespace terrace::tri
