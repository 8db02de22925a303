// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/device_primitives.hpp"

/// Kernels of complete linkage on the band-shaped half matrix (thesis 7.6.2). Row i of `slots` rows
/// has the distances to the slots i+1 .. i+half, modulo `slots`. The number of slots is odd here,
/// if necessary by an additional slot without a cluster, so that no pair is stored twice.

namespace terrace::cluster::device {

/// The clusters of a round, by slot. Pointers into device memory.
template <class Entry>
struct Slots {
  std::uint32_t slots = 0;
  std::uint32_t half = 0;             ///< slots / 2, the length of a row
  Entry* band = nullptr;              ///< squared distances
  std::uint32_t* alive = nullptr;     ///< 1 if there is a cluster
  std::uint32_t* stale = nullptr;     ///< 1 if its nearest neighbour must be searched again
  std::uint32_t* nearest = nullptr;   ///< its nearest neighbour, the lowest slot on ties
  Entry* distance = nullptr;          ///< distance of the nearest neighbour
  std::uint32_t* partner = nullptr;   ///< the slot with which it merges in this round, or itself
  std::uint32_t* original = nullptr;  ///< one of its points

  /// Returns the slot to which an entry of a row refers.
  TERRACE_CLUSTER_HOST_DEVICE std::uint32_t other(std::uint32_t row, std::uint32_t column) const {
    return static_cast<std::uint32_t>(band_partner(slots, {row, column}));
  }
  TERRACE_CLUSTER_HOST_DEVICE Entry& at(std::uint32_t row, std::uint32_t column) const {
    return band[std::uint64_t{row} * half + column];
  }
  TERRACE_CLUSTER_HOST_DEVICE Entry& between(std::uint32_t i, std::uint32_t j) const {
    return band[band_entry(slots, i, j)];
  }
  TERRACE_CLUSTER_HOST_DEVICE bool keeps(std::uint32_t i) const { return partner[i] > i; }
  TERRACE_CLUSTER_HOST_DEVICE bool ends(std::uint32_t i) const { return partner[i] < i; }
};

template <class Entry>
TERRACE_CLUSTER_HOST_DEVICE Entry greater_of(Entry a, Entry b) {
  return a < b ? b : a;
}

/// lanes over rows: computes distances of the points, each rounded to Entry once.
template <class Entry>
struct FillBand {
  Slots<Entry> s;
  const double *x, *y, *z;
  std::uint32_t points;

  TERRACE_CLUSTER_HOST_DEVICE bool skip(std::uint32_t row) const { return row >= points; }
  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::uint32_t row, std::uint32_t lane,
                                              std::uint32_t lanes) const {
    for (std::uint32_t k = lane; k < s.half; k += lanes) {
      const std::uint32_t j = s.other(row, k);
      if (j < points) s.at(row, k) = static_cast<Entry>(squared(x, y, z, row, j));
    }
  }
};

/// each over slots: assigns a cluster to each of the first `points`.
template <class Entry>
struct FillSlots {
  Slots<Entry> s;
  std::uint32_t points;

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t index) const {
    const auto i = static_cast<std::uint32_t>(index);
    s.alive[i] = i < points ? 1 : 0;
    s.stale[i] = s.alive[i];
    s.original[i] = i;
  }
};

template <class Entry>
TERRACE_CLUSTER_HOST_DEVICE Best<Entry> best_of_row(const Slots<Entry>& s, std::uint32_t row,
                                                    std::uint32_t lane, std::uint32_t lanes) {
  Best<Entry> best;
  for (std::uint32_t k = lane; k < s.half; k += lanes) {
    const std::uint32_t j = s.other(row, k);
    if (s.alive[j] != 0) best = nearer(best, {s.at(row, k), j});
  }
  return best;
}

/// reduce over slots: finds the nearest neighbour among those in the slot's own row.
template <class Entry>
struct NearestOfRow {
  Slots<Entry> s;

  TERRACE_CLUSTER_HOST_DEVICE bool skip(std::uint32_t row) const { return s.alive[row] == 0; }
  TERRACE_CLUSTER_HOST_DEVICE Best<Entry> part(std::uint32_t row, std::uint32_t lane,
                                               std::uint32_t lanes) const {
    return best_of_row(s, row, lane, lanes);
  }
  TERRACE_CLUSTER_HOST_DEVICE void finish(std::uint32_t row, const Best<Entry>& best) const {
    s.nearest[row] = best.index;
    s.distance[row] = best.value;
  }
};

/// reduce over slots, if few are stale: finds the nearest neighbour in the slot's own row and in
/// the rows of the others. Accesses to the rows of the others are not contiguous.
template <class Entry>
struct NearestOfStale {
  Slots<Entry> s;

  TERRACE_CLUSTER_HOST_DEVICE bool skip(std::uint32_t i) const { return s.stale[i] == 0; }
  TERRACE_CLUSTER_HOST_DEVICE Best<Entry> part(std::uint32_t i, std::uint32_t lane,
                                               std::uint32_t lanes) const {
    Best<Entry> best = best_of_row(s, i, lane, lanes);
    for (std::uint32_t k = lane; k < s.half; k += lanes) {
      const std::uint32_t row = i > k ? i - k - 1 : i + s.slots - k - 1;
      if (s.alive[row] != 0) best = nearer(best, {s.at(row, k), row});
    }
    return best;
  }
  TERRACE_CLUSTER_HOST_DEVICE void finish(std::uint32_t i, const Best<Entry>& best) const {
    s.nearest[i] = best.index;
    s.distance[i] = best.value;
  }
};

/// each over parts of the rows times slots: finds the nearest neighbour of a slot among the rows of
/// a part. Adjacent indices read adjacent columns of one row.
template <class Entry>
struct NearestOfRows {
  /// A thread reads the rows of its part one after another, so parts should be short. kMaxParts
  /// limits their memory, and kMinRows, the least number of rows in a part, limits the pass over
  /// the results.
  static constexpr std::uint32_t kMaxParts = 128;
  static constexpr std::uint32_t kMinRows = 16;
  static std::uint32_t rows_of(std::uint32_t slots) {
    const std::uint32_t rows = (slots + kMaxParts - 1) / kMaxParts;
    return rows < kMinRows ? kMinRows : rows;
  }
  /// Returns an upper bound of the number of parts for `slots` or fewer slots.
  static std::uint32_t max_parts(std::uint32_t slots) {
    const std::uint32_t parts = (slots + kMinRows - 1) / kMinRows;
    return parts < kMaxParts ? parts : kMaxParts;
  }

  Slots<Entry> s;
  Entry* value;  // one value per part and slot
  std::uint32_t* index;
  std::uint32_t rows;  ///< rows in a part

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t number) const {
    const auto part = static_cast<std::uint32_t>(number / s.slots);
    const auto j = static_cast<std::uint32_t>(number % s.slots);
    if (s.alive[j] == 0) return;  // its result is never read
    const std::uint32_t first = part * rows;
    const std::uint32_t end = first + rows < s.slots ? first + rows : s.slots;
    Best<Entry> best;
    for (std::uint32_t row = first; row < end; ++row) {
      const std::uint32_t steps = j > row ? j - row : j + s.slots - row;
      if (steps <= s.half && s.alive[row] != 0) {
        best = nearer(best, {s.at(row, steps - 1), row});
      }
    }
    value[number] = best.value;
    index[number] = best.index;
  }
};

/// each over slots, after NearestOfRow and NearestOfRows: finds the nearest neighbour overall.
template <class Entry>
struct NearestOfParts {
  Slots<Entry> s;
  const Entry* value;
  const std::uint32_t* index;
  std::uint32_t parts;

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t i) const {
    if (s.alive[i] == 0) return;
    Best<Entry> best{s.distance[i], s.nearest[i]};
    for (std::size_t part = 0; part < parts; ++part) {
      best = nearer(best, {value[part * s.slots + i], index[part * s.slots + i]});
    }
    s.nearest[i] = best.index;
    s.distance[i] = best.value;
  }
};

/// Counters of a round.
struct RoundCounts {
  std::uint32_t pairs, stale;
};

/// each over slots: finds pairs that are each other's nearest. Complete linkage is reducible:
/// merging one such pair brings no cluster nearer to another, so all of them can merge at once.
/// Links are stored by the point of the cluster that disappears, which happens once.
template <class Entry>
struct MatchPairs {
  Slots<Entry> s;
  RoundCounts* counts;
  std::uint32_t round;
  std::uint32_t* link_other;
  std::uint32_t* link_round;
  Entry* link_square;

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t index) const {
    const auto i = static_cast<std::uint32_t>(index);
    s.partner[i] = i;
    if (s.alive[i] == 0) return;
    const std::uint32_t j = s.nearest[i];
    if (s.nearest[j] != i) return;
    s.partner[i] = j;
    if (j < i) return;
    link_other[s.original[j]] = s.original[i];
    link_round[s.original[j]] = round;
    link_square[s.original[j]] = s.distance[i];
    add(&counts->pairs, 1);
  }
};

/// lanes over slots, after MarkStale: updates the distances of merged clusters to the greater ones.
/// The lower of two merged clusters updates the distance of the pair, from the four distances of
/// their halves. Distances of disappearing clusters are only read, so no index reads what another
/// one writes.
template <class Entry>
struct UpdateBand {
  Slots<Entry> s;

  TERRACE_CLUSTER_HOST_DEVICE bool skip(std::uint32_t a) const { return !s.keeps(a); }
  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::uint32_t a, std::uint32_t lane,
                                              std::uint32_t lanes) const {
    const std::uint32_t b = s.partner[a];
    for (std::uint32_t k = lane; k < s.slots; k += lanes) {
      if (k == a || s.alive[k] == 0) continue;
      const bool pair = s.keeps(k);
      if (pair && k < a) continue;
      Entry& kept = s.between(a, k);
      Entry value = greater_of(kept, s.between(b, k));
      if (pair) {
        const std::uint32_t d = s.partner[k];
        value = greater_of(value, greater_of(s.between(a, d), s.between(b, d)));
      }
      kept = value;
    }
  }
};

/// each over slots, after MatchPairs: determines which clusters remain, and whose nearest neighbour
/// may have changed. Distances only grow, so a nearest neighbour that did not merge stays the
/// nearest.
template <class Entry>
struct MarkStale {
  Slots<Entry> s;
  RoundCounts* counts;

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t index) const {
    const auto i = static_cast<std::uint32_t>(index);
    s.stale[i] = 0;
    if (s.alive[i] == 0) return;
    if (s.ends(i)) {
      s.alive[i] = 0;
      return;
    }
    // The nearest neighbour of a cluster that merged is its partner.
    if (s.partner[s.nearest[i]] == s.nearest[i]) return;
    s.stale[i] = 1;
    add(&counts->stale, 1);
  }
};

// Compaction: kernels that move the remaining clusters of a round to the first slots, in order, so
// that the band shrinks with their number. They merge the distances in the same pass.

/// The slots are divided into this many parts, whose clusters are counted concurrently. The parts
/// are divided into groups, so that no thread adds up more than 32 of either.
inline constexpr std::uint32_t kScanParts = 1024;
inline constexpr std::uint32_t kScanGroup = 32;  // parts per group
inline constexpr std::uint32_t kScanCounts = kScanParts + kScanParts / kScanGroup;

/// each over kScanParts: counts clusters. `count` has the parts, then the groups, which start at
/// zero.
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
    add(&count[kScanParts + part / kScanGroup], sum);
  }
};

/// each over kScanParts: sets the new slot of each cluster and the former slot of each new one.
template <class Entry>
struct NumberAlive {
  Slots<Entry> s;
  const std::uint32_t* count;
  std::uint32_t* new_of_old;
  std::uint32_t* old_of_new;

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t part) const {
    const std::size_t length = (s.slots + kScanParts - 1) / kScanParts;
    std::uint32_t next = 0;
    const std::size_t group = part / kScanGroup;
    for (std::size_t g = 0; g < group; ++g) next += count[kScanParts + g];
    for (std::size_t p = group * kScanGroup; p < part; ++p) next += count[p];
    for (std::size_t i = part * length; i < (part + 1) * length && i < s.slots; ++i) {
      new_of_old[i] = kNone;
      if (s.alive[i] == 0) continue;
      old_of_new[next] = static_cast<std::uint32_t>(i);
      new_of_old[i] = next++;
    }
  }
};

/// lanes over new slots: computes the greatest distance between the halves of two clusters.
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

/// each over new slots: copies the data of the remaining clusters.
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
    to.nearest[k] = new_of_old[from.nearest[i]];  // exists, because this slot is not stale
    to.distance[k] = from.distance[i];
    to.original[k] = from.original[i];
  }
};

}  // namespace terrace::cluster::device
