// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

namespace terrace::terrain {

/// Calls work(thread, item) once for every item below `items` on at most `threads` threads, this
/// one among them; items begin in order, `thread` is below `threads`. Of what the calls throw, that
/// of the smallest item is thrown here when all have ended; items after it may be left out.
void parallel_for(std::size_t items, unsigned threads,
                  const std::function<void(unsigned thread, std::size_t item)>& work);

/// Calls work(first_row, last_row) for bands of rows, several at once on `threads` threads. What
/// one band draws must not touch the rows of another. An exception of any band is thrown here.
void for_bands(std::uint32_t rows, unsigned threads,
               const std::function<void(std::uint32_t, std::uint32_t)>& work);

}  // namespace terrace::terrain
