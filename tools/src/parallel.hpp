// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>

namespace terrace::tools {

/// Calls work(thread, item) once for every item below `items` on at most `threads` threads, this
/// one among them; items begin in order, `thread` is below `threads`. Of what the calls throw, that
/// of the smallest item is thrown here when all have ended; items after it may be left out.
void parallel_for(std::size_t items, unsigned threads,
                  const std::function<void(unsigned thread, std::size_t item)>& work);

}  // namespace terrace::tools
