// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <stop_token>

namespace terrace::terrain {

/// Calls work(thread, item) once for every item below `items` on at most `threads` threads, this
/// one among them; items begin in order, `thread` is below `threads`. When all have ended, the
/// exception of the smallest item that threw is rethrown; items after it may be skipped. After a
/// request to stop no further item begins, and stream::Stopped is thrown.
void parallel_for(std::size_t items, unsigned threads,
                  const std::function<void(unsigned thread, std::size_t item)>& work,
                  const std::stop_token& stop = {});

/// Calls work(first_row, last_row) for bands of rows, concurrently on `threads` threads. A band
/// must not touch the rows of another. An exception of any band is rethrown. stop: as above.
void for_bands(std::uint32_t rows, unsigned threads,
               const std::function<void(std::uint32_t, std::uint32_t)>& work,
               const std::stop_token& stop = {});

}  // namespace terrace::terrain
