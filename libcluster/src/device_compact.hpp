// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "device_band.hpp"

/// Kernels that move the clusters that a round leaves to the first slots, in order, so that the
/// band shrinks with their number, and merge their distances on the way.

namespace terrace::cluster::device {

/// The slots are cut into this many parts, whose clusters are counted at the same time.
inline constexpr std::uint32_t kScanParts = 1024;

/// each over kScanParts.
template <class Entry>
struct CountAlive {
  Slots<Entry> s;
  std::uint32_t* count;

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t part) const {
    const std::size_t length = (s.slots + kScanParts - 1) / kScanParts;
    std::uint32_t sum = 0;
    for (std::size_t i = part * length; i < (part + 1) * length && i < s.slots; ++i) {
      sum += s.alive[i];
    }
    count[part] = sum;
  }
};

/// each over kScanParts: the new slot of each cluster and the old one of each new slot.
template <class Entry>
struct NumberAlive {
  Slots<Entry> s;
  const std::uint32_t* count;
  std::uint32_t* new_of_old;
  std::uint32_t* old_of_new;

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t part) const {
    const std::size_t length = (s.slots + kScanParts - 1) / kScanParts;
    std::uint32_t next = 0;
    for (std::size_t p = 0; p < part; ++p) next += count[p];
    for (std::size_t i = part * length; i < (part + 1) * length && i < s.slots; ++i) {
      new_of_old[i] = kNone;
      if (s.alive[i] == 0) continue;
      old_of_new[next] = static_cast<std::uint32_t>(i);
      new_of_old[i] = next++;
    }
  }
};

/// lanes over new slots: of two clusters the greatest distance between their halves.
template <class Entry>
struct MergeBand {
  Slots<Entry> from, to;
  const std::uint32_t* old_of_new;
  std::uint32_t clusters;

  TERRACE_CLUSTER_HOST_DEVICE bool skip(std::uint32_t row) const { return row >= clusters; }
  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::uint32_t row, std::uint32_t lane,
                                              std::uint32_t lanes) const {
    const std::uint32_t a = old_of_new[row];
    const std::uint32_t b = from.partner[a];
    for (std::uint32_t k = lane; k < to.half; k += lanes) {
      const std::uint32_t other = to.other(row, k);
      if (other >= clusters) continue;
      const std::uint32_t c = old_of_new[other];
      const std::uint32_t d = from.partner[c];
      Entry value = from.between(a, c);
      if (d != c) value = greater_of(value, from.between(a, d));
      if (b != a) value = greater_of(value, from.between(b, c));
      if (b != a && d != c) value = greater_of(value, from.between(b, d));
      to.at(row, k) = value;
    }
  }
};

/// each over new slots.
template <class Entry>
struct MergeSlots {
  Slots<Entry> from, to;
  const std::uint32_t* new_of_old;
  const std::uint32_t* old_of_new;
  std::uint32_t clusters;

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t k) const {
    to.alive[k] = k < clusters ? 1 : 0;
    to.stale[k] = 0;
    if (k >= clusters) return;
    const std::uint32_t i = old_of_new[k];
    to.stale[k] = from.stale[i];
    to.nearest[k] = new_of_old[from.nearest[i]];  // of one that is not stale there is a cluster
    to.distance[k] = from.distance[i];
    to.original[k] = from.original[i];
  }
};

}  // namespace terrace::cluster::device
