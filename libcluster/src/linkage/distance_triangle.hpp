// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "linkage/cluster_slots.hpp"
#include "linkage/points.hpp"
#include "terrace/cluster/linkage.hpp"

/// Clusters of any items, with the distances of all pairs. Private to linkage.

namespace terrace::cluster {

/// A matrix of n (n - 1) / 2 entries, scaled by a power of two. When clusters merge, the distances
/// of the new one follow from the distances of its parts, by the formulas of G. Lance and W.
/// Williams, 1967.
template <class T>
class DistanceTriangle : public ClusterSlots {
 public:
  /// Throws: std::invalid_argument if the entries need more than options.memory_limit.
  DistanceTriangle(const LinkagePoints& points, LinkageMethod method,
                   const LinkageOptions& options);
  /// Throws: also for a distance that is negative or not finite. The message names the pair.
  DistanceTriangle(std::size_t count, const PairDistance& distance, LinkageMethod method,
                   const LinkageOptions& options);

  [[nodiscard]] double distance(std::uint32_t a, std::uint32_t b) const {
    return a < b ? row(b)[a] : row(a)[b];
  }
  [[nodiscard]] NearCluster nearest(std::uint32_t x, std::uint32_t begin, std::uint32_t end,
                                    NearCluster best) const;
  void join(std::uint32_t low, std::uint32_t high, double between);
  void move(const std::vector<std::uint32_t>& slots);
  [[nodiscard]] double height(double distance) const;

 private:
  DistanceTriangle(std::size_t count, LinkageMethod method, const LinkageOptions& options);
  /// Returns the distances to the preceding slots.
  [[nodiscard]] T* row(std::size_t slot) { return entries_.get() + slot * (slot - 1) / 2; }
  [[nodiscard]] const T* row(std::size_t slot) const {
    return entries_.get() + slot * (slot - 1) / 2;
  }
  [[nodiscard]] double combined(double to_low, double to_high, double between, double low,
                                double high, double other) const;

  const LinkageMethod method_;
  const bool squares_;  ///< entries are squares
  std::unique_ptr<T[]> entries_;
  int exponent_ = 0;
};

extern template class DistanceTriangle<float>;
extern template class DistanceTriangle<double>;

}  // namespace terrace::cluster
