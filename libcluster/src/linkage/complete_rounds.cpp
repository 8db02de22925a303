// SPDX-License-Identifier: Apache-2.0
#include "linkage/complete_rounds.hpp"

#include <algorithm>
#include <cassert>
#include <limits>

#include <terrace/base/parallel.hpp>
#include <terrace/base/stop_check.hpp>

namespace terrace::cluster {
namespace {

constexpr std::size_t kRowsPerBlock = 32;
constexpr std::size_t kMinThreadedSize = 512;  ///< with fewer clusters threads do not pay off
/// After a round that merges less than 1/8 of the clusters, the chain takes over.
constexpr std::size_t kChainBelow = 8;

constexpr std::uint32_t kPairsPerCheck = 256;
constexpr std::size_t kPrefetch = 8;

}  // namespace

template <class T>
CompleteRounds<T>::CompleteRounds(BandMatrix<T>& matrix, const LinkageKernels<T>& kernels,
                                  const LinkageOptions& options)
    : kernels_(kernels),
      threads_(std::clamp(options.threads, 1u, 256u)),
      check_stop_(options.check_stop),
      clusters_(matrix.size()),
      columns_(threads_) {
  const auto n = static_cast<std::uint32_t>(matrix.size());
  for (std::uint32_t c = 0; c < n; ++c) {
    const bool second_copy = n % 2 == 0 && c >= n / 2;
    clusters_[c] = {matrix.row(c), n / 2 - (second_copy ? 1u : 0u), c};
  }
}

template <class T>
std::vector<Link> CompleteRounds<T>::run(const FillRow& fill) {
  begin_minima(size());
  base::parallel_blocks(
      size(), kRowsPerBlock, threads(), [&](std::size_t begin, std::size_t end, unsigned thread) {
        for (std::size_t c = begin; c < end; ++c) {
          check_stop();
          fill(c, clusters_[c].row);
          note_minima(static_cast<std::uint32_t>(c), clusters_[c], size(), columns_[thread]);
        }
      });
  end_minima();
  while (size() > 1) {
    const std::size_t before = size();
    const std::size_t pairs = match();
    list_parts();
    base::parallel_blocks(first_.size(), kRowsPerBlock, threads(),
                          [&](std::size_t begin, std::size_t end, unsigned thread) {
                            check_stop();
                            for (std::size_t k = begin; k < end; ++k) {
                              fetch_entries(static_cast<std::uint32_t>(k), columns_[thread]);
                            }
                          });
    shrink();
    if (pairs * kChainBelow < before && size() > 1) {
      chain();
      shrink();
    }
  }
  return std::move(links_);
}

template <class T>
unsigned CompleteRounds<T>::threads() const {
  return size() < kMinThreadedSize ? 1 : threads_;
}

template <class T>
typename CompleteRounds<T>::Pieces CompleteRounds<T>::pieces(std::uint32_t c) const {
  const Cluster& cluster = clusters_[c];
  const std::uint32_t after = std::min(cluster.length, size() - 1 - c);
  return {{c + 1, c + 1 + after, cluster.row}, {0, cluster.length - after, cluster.row + after}};
}

template <class T>
void CompleteRounds<T>::begin_minima(std::size_t count) {
  row_nearest_.resize(count);
  for (Columns& columns : columns_) {
    columns.best.assign(count, std::numeric_limits<T>::infinity());
    columns.row.assign(count, 0);
  }
}

/// Records the minima of the row of cluster c, one of `count` clusters.
template <class T>
void CompleteRounds<T>::note_minima(std::uint32_t c, const Cluster& cluster, std::uint32_t count,
                                    Columns& columns) {
  const std::uint32_t after = std::min(cluster.length, count - 1 - c);
  const std::uint32_t wrapped = cluster.length - after;
  T least = std::numeric_limits<T>::infinity();
  std::uint32_t place = kNone;
  const auto row = static_cast<Index>(c);
  const std::size_t first = kernels_.minima(cluster.row, after, row, columns.best.data() + c + 1,
                                            columns.row.data() + c + 1, &least);
  if (first < after) place = c + 1 + static_cast<std::uint32_t>(first);
  const std::size_t second = kernels_.minima(cluster.row + after, wrapped, row, columns.best.data(),
                                             columns.row.data(), &least);
  if (second < wrapped) place = static_cast<std::uint32_t>(second);
  row_nearest_[c] = {least, place};
}

/// Combines the threads' minima. Each thread took rows in ascending order, so the first on ties is
/// the one with the lowest number.
template <class T>
void CompleteRounds<T>::end_minima() {
  column_nearest_.assign(row_nearest_.size(), {std::numeric_limits<T>::infinity(), kNone});
  for (const Columns& columns : columns_) {
    for (std::size_t c = 0; c < column_nearest_.size(); ++c) {
      const auto row = static_cast<std::uint32_t>(columns.row[c]);
      Nearest& best = column_nearest_[c];
      if (columns.best[c] < best.distance ||
          (columns.best[c] == best.distance && row < best.cluster)) {
        best = {columns.best[c], row};
      }
    }
  }
}

template <class T>
const typename CompleteRounds<T>::Nearest& CompleteRounds<T>::nearest(std::uint32_t c) const {
  return column_nearest_[c].distance < row_nearest_[c].distance ? column_nearest_[c]
                                                                : row_nearest_[c];
}

/// Pairs up clusters that are each other's nearest. Ties are frequent on regular grids. A cluster
/// then chooses the nearest in its row or in its column, whichever is not yet paired. If every
/// cluster had only one choice, few pairs would form.
template <class T>
std::size_t CompleteRounds<T>::match() {
  partner_.assign(size(), kNone);
  const std::size_t before = links_.size();
  for (std::uint32_t c = 0; c < size(); ++c) {
    if (partner_[c] == kNone && !pair_up(c, row_nearest_[c])) pair_up(c, column_nearest_[c]);
  }
  assert(links_.size() > before);
  return links_.size() - before;
}

template <class T>
bool CompleteRounds<T>::pair_up(std::uint32_t c, const Nearest& candidate) {
  const std::uint32_t other = candidate.cluster;
  if (other == kNone || partner_[other] != kNone) return false;
  const T distance = nearest(c).distance;
  if (candidate.distance != distance || nearest(other).distance != distance) return false;
  partner_[c] = other;
  partner_[other] = c;
  links_.push_back({clusters_[c].name, clusters_[other].name, static_cast<double>(distance)});
  return true;
}

/// Lists the new clusters in the order of their first parts.
template <class T>
void CompleteRounds<T>::list_parts() {
  first_.clear();
  second_.clear();
  pair_first_.clear();
  pair_second_.clear();
  new_cluster_.resize(size());
  first_parts_before_.resize(size() + 1);
  for (std::uint32_t c = 0; c < size(); ++c) {
    first_parts_before_[c] = static_cast<std::uint32_t>(first_.size());
    if (partner_[c] != kNone && partner_[c] < c) continue;
    const std::uint32_t other = partner_[c] == kNone ? c : partner_[c];
    new_cluster_[c] = new_cluster_[other] = first_parts_before_[c];
    first_.push_back(c);
    second_.push_back(other);
    if (other != c) {
      pair_first_.push_back(c);
      pair_second_.push_back(other);
    }
  }
  first_parts_before_[size()] = static_cast<std::uint32_t>(first_.size());
}

/// Returns the new cluster k with its row. Requires that fetch_entries(k) has run.
template <class T>
typename CompleteRounds<T>::Cluster CompleteRounds<T>::merged_row(std::uint32_t k,
                                                                  Columns& columns) {
  const std::uint32_t a = first_[k];
  const std::uint32_t m = size();
  const Pieces own = pieces(a);
  T* const wide = columns.buffer.data();
  // Where the row of a has no entry, writes zeros, which are never the larger value.
  std::fill(wide + own.wrapped.end, wide + a + 1, T{0});
  std::fill(wide + own.after.end, wide + m, T{0});
  std::copy_n(own.after.values, own.after.end - own.after.begin, wide + own.after.begin);
  std::copy_n(own.wrapped.values, own.wrapped.end, wide);
  if (second_[k] != a) {
    const Pieces other = pieces(second_[k]);
    for (const Piece& to : {own.after, own.wrapped}) {
      for (const Piece& from : {other.after, other.wrapped}) {
        const std::uint32_t begin = std::max(to.begin, from.begin);
        const std::uint32_t end = std::min(to.end, from.end);
        if (begin < end)
          kernels_.raise(wide + begin, from.values + (begin - from.begin), end - begin);
      }
    }
  }
  const auto count = static_cast<std::uint32_t>(first_.size());
  const std::uint32_t after =
      first_parts_before_[own.after.end] - first_parts_before_[own.after.begin];
  const std::uint32_t wrapped = first_parts_before_[own.wrapped.end];
  assert(wrapped == 0 || k + 1 + after == count);
  (void)count;
  T* const row = clusters_[a].row;
  kernels_.pick(wide, first_.data() + k + 1, second_.data() + k + 1, after, row);
  kernels_.pick(wide, first_.data(), second_.data(), wrapped, row + after);
  return {row, after + wrapped, clusters_[a].name};
}

/// Replaces the clusters by the new ones and finds their nearest.
template <class T>
void CompleteRounds<T>::shrink() {
  const auto count = static_cast<std::uint32_t>(first_.size());
  begin_minima(count);
  for (Columns& columns : columns_) columns.buffer.resize(size());
  std::vector<Cluster> next(count);
  base::parallel_blocks(count, kRowsPerBlock, threads(),
                        [&](std::size_t begin, std::size_t end, unsigned thread) {
                          check_stop();
                          for (std::size_t k = begin; k < end; ++k) {
                            const auto c = static_cast<std::uint32_t>(k);
                            next[k] = merged_row(c, columns_[thread]);
                            note_minima(c, next[k], count, columns_[thread]);
                          }
                        });
  clusters_.swap(next);
  end_minima();
}

// Entries of merged clusters can be in the rows of other clusters. If close clusters have close
// rows these are few, but each is in a different row.

/// merged_row() builds the row of the new cluster k from the rows of its parts. This function
/// copies the entries that it needs from rows of other clusters into the row of the first part. It
/// reads only entries with a second part and writes only entries of two first parts, so threads may
/// call it for different clusters concurrently.
template <class T>
void CompleteRounds<T>::fetch_entries(std::uint32_t k, Columns& columns) {
  std::vector<std::uint32_t>& others = columns.others;
  list_others(k, others);
  const std::uint32_t a = first_[k];
  const auto for_entries = [&](std::uint32_t other, auto action) {
    const std::uint32_t c = first_[other];
    if (second_[other] != c) action(entry(a, second_[other]));
    if (second_[k] == a) return;
    action(entry(second_[k], c));
    if (second_[other] != c) action(entry(second_[k], second_[other]));
  };
  // Each entry is in another row, far from the last.
  for (std::size_t i = 0; i < others.size(); ++i) {
    if (i + kPrefetch < others.size()) {
      for_entries(others[i + kPrefetch], [](const T& from) { __builtin_prefetch(&from); });
    }
    const std::uint32_t c = first_[others[i]];
    T& to = clusters_[a].row[offset(a, c)];
    for_entries(others[i], [&to](const T& from) { to = std::max(to, from); });
  }
}

/// Lists the new clusters whose entry is in the row of k but depends on an entry of another
/// cluster's row. Such an entry is neither in the row of the first part of k nor, in a column of
/// that row, in the row of the second part.
template <class T>
void CompleteRounds<T>::list_others(std::uint32_t k, std::vector<std::uint32_t>& others) const {
  others.clear();
  const std::uint32_t m = size();
  const std::uint32_t a = first_[k];
  const std::uint32_t b = second_[k];
  const std::uint32_t length = clusters_[a].length;
  if (b != a) {
    // Clusters in the row of a that are not in the row of b. Offsets count from a.
    const std::uint32_t begin = b - a;
    const std::uint32_t end = begin + clusters_[b].length;
    const auto list = [&](std::uint32_t from, std::uint32_t to) {
      for (std::uint32_t step = from; step <= to; ++step) {
        const std::uint32_t j = a + step < m ? a + step : a + step - m;
        const std::uint32_t other = new_cluster_[j];
        if (j != b && holds(a, first_[other])) others.push_back(other);
      }
    };
    if (end < m) {
      list(1, std::min(length, begin));
      list(end + 1, length);
    } else {
      list(end - m + 1, std::min(length, begin));
    }
  }
  // Pairs with one cluster in the row of a and the other not.
  for (std::size_t p = 0; p < pair_first_.size(); p += kPairsPerCheck) {
    const std::size_t count = std::min<std::size_t>(kPairsPerCheck, pair_first_.size() - p);
    if (kernels_.straddling(pair_first_.data() + p, pair_second_.data() + p, count, a, length, m) ==
        0) {
      continue;
    }
    for (std::size_t q = p; q < p + count; ++q) {
      if (pair_first_[q] != a && holds(a, pair_first_[q]) && !holds(a, pair_second_[q])) {
        others.push_back(new_cluster_[pair_first_[q]]);
      }
    }
  }
}

// The nearest-neighbour chain starts at any cluster and goes from each cluster to its nearest,
// until two are each other's nearest and merge. Each step examines m distances, half of them in
// different rows, so the chain is used only if rounds would merge too few clusters.

/// Merges until three quarters of the clusters remain, and lists those. Entries of merged clusters
/// become infinite. Takes O(m^2) time, because a cluster joins the chain once for itself and at
/// most twice for each merge.
template <class T>
void CompleteRounds<T>::chain() {
  const std::uint32_t m = size();
  const std::uint32_t enough = std::max(1u, m - m / 4);
  std::vector<bool> gone(m, false);
  std::vector<std::uint32_t> chain;
  std::uint32_t start = 0;
  base::StopTicks ticks(check_stop_);
  for (std::uint32_t left = m; left > enough;) {
    ticks(m);
    if (chain.empty()) {
      while (gone[start]) ++start;
      chain.push_back(start);
    }
    const std::uint32_t c = chain.back();
    // On ties takes the previous cluster of the chain. Otherwise the chain might never end.
    Nearest best{std::numeric_limits<T>::infinity(), kNone};
    if (chain.size() > 1) best = {entry(c, chain[chain.size() - 2]), chain[chain.size() - 2]};
    best = nearest_of(c, best);
    if (chain.size() == 1 || best.cluster != chain[chain.size() - 2]) {
      chain.push_back(best.cluster);
      continue;
    }
    chain.resize(chain.size() - 2);
    const std::uint32_t a = std::min(c, best.cluster);
    const std::uint32_t b = std::max(c, best.cluster);
    links_.push_back({clusters_[a].name, clusters_[b].name, static_cast<double>(best.distance)});
    merge_into(a, b);
    gone[b] = true;
    --left;
  }
  first_.clear();
  for (std::uint32_t c = 0; c < m; ++c) {
    first_parts_before_[c] = static_cast<std::uint32_t>(first_.size());
    if (!gone[c]) first_.push_back(c);
  }
  first_parts_before_[m] = static_cast<std::uint32_t>(first_.size());
  second_ = first_;
}

/// Returns the cluster nearest to c, or `best` if no cluster is nearer than that.
template <class T>
typename CompleteRounds<T>::Nearest CompleteRounds<T>::nearest_of(std::uint32_t c, Nearest best) {
  const Pieces own = pieces(c);
  for (const Piece& piece : {own.after, own.wrapped}) {
    for (std::uint32_t j = piece.begin; j < piece.end; ++j) {
      const T distance = piece.values[j - piece.begin];
      if (distance < best.distance) best = {distance, j};
    }
  }
  // All other clusters have c in their rows.
  const auto look = [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t j = begin; j < end; ++j) {
      const T distance = clusters_[j].row[offset(j, c)];
      if (distance < best.distance) best = {distance, j};
    }
  };
  look(own.wrapped.end, c);
  look(own.after.end, size());
  return best;
}

template <class T>
void CompleteRounds<T>::merge_into(std::uint32_t a, std::uint32_t b) {
  constexpr T kMerged = std::numeric_limits<T>::infinity();
  for (std::uint32_t c = 0; c < size(); ++c) {
    if (c == a || c == b) continue;
    T& from = entry(b, c);
    T& to = entry(a, c);
    to = std::max(to, from);
    from = kMerged;
  }
  entry(a, b) = kMerged;
}

template class CompleteRounds<float>;
template class CompleteRounds<double>;

}  // namespace terrace::cluster
