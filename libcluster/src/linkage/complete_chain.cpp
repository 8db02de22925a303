// SPDX-License-Identifier: Apache-2.0
// The nearest-neighbour chain of complete linkage: from any cluster to its nearest, on to the
// nearest of that, until two are each other's nearest and merge. Each step looks at m distances,
// half of them one per row, so it serves only where rounds would merge too few clusters.
#include <algorithm>
#include <limits>

#include "linkage/complete_rounds.hpp"

namespace terrace::cluster {

/// Merges until three quarters of the clusters are left, and lists those. Entries of clusters that
/// are gone are infinite. O(m^2): a cluster joins the chain once for itself and at most twice for
/// each merge.
template <class T>
void CompleteRounds<T>::chain() {
  const std::uint32_t m = size();
  const std::uint32_t enough = std::max(1u, m - m / 4);
  std::vector<bool> gone(m, false);
  std::vector<std::uint32_t> chain;
  std::uint32_t start = 0;
  for (std::uint32_t left = m; left > enough;) {
    if (chain.empty()) {
      while (gone[start]) ++start;
      chain.push_back(start);
    }
    const std::uint32_t c = chain.back();
    // Of equally near ones the last on the chain: it would never end otherwise.
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
    firsts_before_[c] = static_cast<std::uint32_t>(first_.size());
    if (!gone[c]) first_.push_back(c);
  }
  firsts_before_[m] = static_cast<std::uint32_t>(first_.size());
  second_ = first_;
}

/// The nearest to c, or `best` if none is nearer than that.
template <class T>
typename CompleteRounds<T>::Nearest CompleteRounds<T>::nearest_of(std::uint32_t c, Nearest best) {
  const Pieces own = pieces(c);
  for (const Piece& piece : {own.after, own.wrapped}) {
    for (std::uint32_t j = piece.begin; j < piece.end; ++j) {
      const T distance = piece.values[j - piece.begin];
      if (distance < best.distance) best = {distance, j};
    }
  }
  // All others have c in their rows.
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

template void CompleteRounds<float>::chain();
template CompleteRounds<float>::Nearest CompleteRounds<float>::nearest_of(std::uint32_t, Nearest);
template void CompleteRounds<float>::merge_into(std::uint32_t, std::uint32_t);
template void CompleteRounds<double>::chain();
template CompleteRounds<double>::Nearest CompleteRounds<double>::nearest_of(std::uint32_t, Nearest);
template void CompleteRounds<double>::merge_into(std::uint32_t, std::uint32_t);

}  // namespace terrace::cluster
