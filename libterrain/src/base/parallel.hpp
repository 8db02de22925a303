// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stop_token>
#include <type_traits>

#include <terrace/base/parallel.hpp>
#include <terrace/stream/error.hpp>

namespace terrace::terrain {

/// base::parallel_for() with a stop token: after a stop request it starts no further item and
/// throws stream::Stopped.
template <class Work>
void parallel_for(std::size_t items, unsigned threads, const Work& work,
                  const std::stop_token& stop = {}) {
  base::parallel_for(items, std::max(1u, threads), [&](std::size_t item, unsigned thread) {
    if (stop.stop_requested()) throw stream::Stopped();
    if constexpr (std::is_invocable_v<const Work&, std::size_t, unsigned>) {
      work(item, thread);
    } else {
      work(item);
    }
  });
}

/// Calls work(begin, end) concurrently for bands of rows [begin, end). A band must not touch the
/// rows of another. Throws as parallel_for().
template <class Work>
void parallel_bands(std::uint32_t rows, unsigned threads, const Work& work,
                    const std::stop_token& stop = {}) {
  const std::uint32_t bands = std::clamp<std::uint32_t>(threads * 4, 1, std::max(rows / 16, 1u));
  parallel_for(
      bands, threads,
      [&](std::size_t band) {
        work(static_cast<std::uint32_t>(std::uint64_t{rows} * band / bands),
             static_cast<std::uint32_t>(std::uint64_t{rows} * (band + 1) / bands));
      },
      stop);
}

}  // namespace terrace::terrain
