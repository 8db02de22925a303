// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include <terrace/base/parallel.hpp>

#include "pool.hpp"

/// Sorts points by their cell on a space-filling curve.

namespace terrace::tri {

/// Calls work(from, to) for ranges of 0 .. count - 1, on several threads if that pays.
template <class Work>
void for_ranges(std::uint32_t count, unsigned threads, const Work& work) {
  constexpr std::uint32_t kRange = 16384;
  if (threads < 2 || count < 2 * kRange) {
    work(0, count);
    return;
  }
  base::parallel_blocks(count, kRange, threads, [&](std::size_t from, std::size_t to) {
    work(static_cast<std::uint32_t>(from), static_cast<std::uint32_t>(to));
  });
}

struct CurveEntry {
  std::uint32_t key;
  std::uint32_t number;
};

/// Stable, least significant digit first: `kPasses` passes of kDigit bits.
template <unsigned kDigit, unsigned kPasses>
void radix_sort(Pool<CurveEntry>& entries) {
  constexpr std::size_t kDigits = std::size_t{1} << kDigit;
  std::array<std::array<std::uint32_t, kDigits>, kPasses> start{};
  for (const CurveEntry& entry : span_of(entries))
    for (unsigned pass = 0; pass < kPasses; ++pass)
      ++start[pass][entry.key >> (kDigit * pass) & (kDigits - 1)];
  for (auto& counters : start)
    std::exclusive_scan(counters.begin(), counters.end(), counters.begin(), 0u);
  Pool<CurveEntry> other;
  other.resize(entries.size());
  for (unsigned pass = 0; pass < kPasses; ++pass) {
    for (const CurveEntry& entry : span_of(entries))
      other[start[pass][entry.key >> (kDigit * pass) & (kDigits - 1)]++] = entry;
    std::swap(entries, other);
  }
}

/// Sorts a range of point indices. cells_of(range) lays a raster over these points: single()
/// returns whether they all coincide, key(index) is the position of a point's cell on the curve, of
/// kKeyBits bits. Points in one cell are distinguished by the next raster, over fewer points, so
/// recursion is never deep. Threads compute keys. sort_run(run) sorts the points of one cell, which
/// are few or all coincide.
template <unsigned kKeyBits, class CellsOf, class SortRun>
void sort_along_curve(std::span<std::uint32_t> order, const CellsOf& cells_of, unsigned threads,
                      const SortRun& sort_run) {
  // Runs of equal keys up to this length are not parted further.
  constexpr std::size_t kLeaf = 16;
  // Below this, counters would cost more than points.
  constexpr std::uint32_t kFew = 3000;
  const auto cells = cells_of(order);
  if (cells.single()) return sort_run(order);
  const auto count = static_cast<std::uint32_t>(order.size());
  Pool<CurveEntry> entries;
  entries.resize(count);
  // Few points are separated by the curve's coarse cells, or otherwise in the runs below.
  const bool few = count < kFew;
  const unsigned shift = few ? kKeyBits - 16 : 0;
  for_ranges(count, threads, [&](std::uint32_t from, std::uint32_t to) {
    for (std::uint32_t i = from; i < to; ++i) entries[i] = {cells.key(order[i]) >> shift, order[i]};
  });
  if (few) {
    radix_sort<8, 2>(entries);
  } else {
    radix_sort<(kKeyBits + 2) / 3, 3>(entries);
  }
  // Entries are freed before the runs are sorted, so that memory does not add up.
  std::vector<std::span<std::uint32_t>> long_runs;
  std::uint32_t begin = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    order[i] = entries[i].number;
    if (i + 1 == count || entries[i + 1].key != entries[i].key) {
      const std::span<std::uint32_t> run = order.subspan(begin, i + 1 - begin);
      if (run.size() > kLeaf) {
        long_runs.push_back(run);
      } else if (run.size() > 1) {
        sort_run(run);
      }
      begin = i + 1;
    }
  }
  entries.release();
  for (const std::span<std::uint32_t> run : long_runs)
    sort_along_curve<kKeyBits>(run, cells_of, 1, sort_run);
}

/// The same. Points of one cell stay in their order.
template <unsigned kKeyBits, class CellsOf>
void sort_along_curve(std::span<std::uint32_t> order, const CellsOf& cells_of,
                      unsigned threads = 1) {
  sort_along_curve<kKeyBits>(order, cells_of, threads, [](std::span<std::uint32_t>) {});
}

/// Indices of the points along a Hilbert curve over their bounding square or cube, so that points
/// close in the result are close in the plane or in space. Points that 16 (in space 10) bits per
/// axis cannot distinguish are sorted in their own square or cube. Points must be valid. O(n).
/// Needs 16 bytes per point besides the result.
template <class Point>
Pool<std::uint32_t> hilbert_order(std::span<const Point> points, unsigned threads = 1);

}  // namespace terrace::tri
