// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "linkage/kernels.hpp"

/// Included once for each instruction set, with TERRACE_VECTOR_BYTES as the size of its registers.
/// Everything is local to the object (see tests/check_symbols.sh), so functions of the standard
/// library are not called either.

namespace terrace::cluster {
namespace {

template <class T>
void distances(const double* x, const double* y, const double* z, std::size_t count, double px,
               double py, double pz, T* __restrict out) {
  for (std::size_t k = 0; k < count; ++k) {
    const double dx = px - x[k];
    const double dy = py - y[k];
    const double dz = pz - z[k];
    out[k] = static_cast<T>(dx * dx + dy * dy + dz * dz);
  }
}

template <class T>
std::size_t minima(const T* v, std::size_t count, LaneIndex<T> row, T* best, LaneIndex<T>* best_row,
                   T* least) {
  using Index = LaneIndex<T>;
  constexpr std::size_t kLanes = TERRACE_VECTOR_BYTES / sizeof(T);
  typedef T Values __attribute__((vector_size(TERRACE_VECTOR_BYTES), aligned(sizeof(T))));
  typedef Index Indices __attribute__((vector_size(TERRACE_VECTOR_BYTES), aligned(sizeof(T))));
  const Values start = Values{} + *least;
  const Indices rows = Indices{} + row;
  Values low = start;
  Indices place = Indices{} + static_cast<Index>(count);
  Indices here;
  for (std::size_t lane = 0; lane < kLanes; ++lane) here[lane] = static_cast<Index>(lane);
  std::size_t k = 0;
  for (; k + kLanes <= count; k += kLanes) {
    const Values x = *reinterpret_cast<const Values*>(v + k);
    Values* const column = reinterpret_cast<Values*>(best + k);
    Indices* const column_row = reinterpret_cast<Indices*>(best_row + k);
    const Indices nearer = x < *column;
    *column = nearer ? x : *column;
    *column_row = nearer ? rows : *column_row;
    const Indices lower = x < low;
    low = lower ? x : low;
    place = lower ? here : place;
    here += static_cast<Index>(kLanes);
  }
  std::size_t nearest = count;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const auto at = static_cast<std::size_t>(place[lane]);
    if (low[lane] < *least || (low[lane] == *least && at < nearest)) {
      *least = low[lane];
      nearest = at;
    }
  }
  for (; k < count; ++k) {
    if (v[k] < best[k]) {
      best[k] = v[k];
      best_row[k] = row;
    }
    if (v[k] < *least) {
      *least = v[k];
      nearest = k;
    }
  }
  return nearest;
}

template <class T>
void raise(T* __restrict to, const T* __restrict from, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k) to[k] = to[k] < from[k] ? from[k] : to[k];
}

template <class T>
void pick(const T* __restrict from, const std::uint32_t* first, const std::uint32_t* second,
          std::size_t count, T* __restrict out) {
  for (std::size_t k = 0; k < count; ++k) {
    const T x = from[first[k]];
    const T y = from[second[k]];
    out[k] = x < y ? y : x;
  }
}

std::uint32_t straddling(const std::uint32_t* first, const std::uint32_t* second, std::size_t count,
                         std::uint32_t a, std::uint32_t length, std::uint32_t m) {
  std::uint32_t sum = 0;
  for (std::size_t k = 0; k < count; ++k) {
    // Offsets from a + 1, modulo m.
    const std::uint32_t x = first[k] + (first[k] > a ? 0u : m) - a - 1;
    const std::uint32_t y = second[k] + (second[k] > a ? 0u : m) - a - 1;
    sum += static_cast<std::uint32_t>(x < length) & static_cast<std::uint32_t>(y >= length);
  }
  return sum;
}

}  // namespace
}  // namespace terrace::cluster
