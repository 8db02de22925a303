// SPDX-License-Identifier: Apache-2.0
// Entries of merged clusters that are in the rows of others. With near clusters in near rows they
// are few, but each is a row apart from the next.
#include <algorithm>

#include "linkage/complete_rounds.hpp"

namespace terrace::cluster {
namespace {

constexpr std::uint32_t kPairsPerCheck = 256;
constexpr std::size_t kPrefetch = 8;

}  // namespace

/// shrunk() makes the row of the new cluster k of those of its parts. What it needs from rows of
/// others is brought in here, into the row of the first part. That only reads entries with a second
/// part, and only writes entries of two first parts, so all clusters may do it at once.
template <class T>
void CompleteRounds<T>::bring_in(std::uint32_t k, Columns& columns) {
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
  // Each is in another row, far from the last.
  for (std::size_t i = 0; i < others.size(); ++i) {
    if (i + kPrefetch < others.size()) {
      for_entries(others[i + kPrefetch], [](const T& from) { __builtin_prefetch(&from); });
    }
    const std::uint32_t c = first_[others[i]];
    T& to = clusters_[a].row[offset(a, c)];
    for_entries(others[i], [&to](const T& from) { to = std::max(to, from); });
  }
}

/// New clusters whose entry belongs to the row of k, with an entry of their parts that is neither
/// in the row of the first part of k nor, in a column of that row, in the row of the second.
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
  // Pairs of which one is in the row of a and the other is not.
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

template void CompleteRounds<float>::bring_in(std::uint32_t, Columns&);
template void CompleteRounds<float>::list_others(std::uint32_t, std::vector<std::uint32_t>&) const;
template void CompleteRounds<double>::bring_in(std::uint32_t, Columns&);
template void CompleteRounds<double>::list_others(std::uint32_t, std::vector<std::uint32_t>&) const;

}  // namespace terrace::cluster
