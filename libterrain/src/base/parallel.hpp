// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

namespace terrace::terrain {

/// Calls work(thread, item) once for every item below `items` on at most `threads` threads, this
/// one among them; items begin in order, `thread` is below `threads`. When all have ended, the
/// exception of the smallest item that threw is rethrown; items after it may be skipped.
void parallel_for(std::size_t items, unsigned threads,
                  const std::function<void(unsigned thread, std::size_t item)>& work);

/// Calls work(first_row, last_row) for bands of rows, concurrently on `threads` threads. A band
/// must not touch the rows of another. An exception of any band is rethrown.
void for_bands(std::uint32_t rows, unsigned threads,
               const std::function<void(std::uint32_t, std::uint32_t)>& work);

}  // namespace terrace::terrain
