// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "terrace/stream/point.hpp"

namespace terrace::tools {

/// A synthetic cloud. Returns its n-th point, which depends only on n and the seed, so any number
/// of threads can compute points in any order. Coordinates are multiples of a unit (1 mm or 10^-6),
/// like the decimals of real scans. Results are identical on every machine.
using Cloud = std::function<stream::Point3(std::uint64_t n)>;

/// Returns a scan of a bumpy closed surface with a radius of about 100 m. Swaths are 500 points
/// wide, run line by line around the body, and proceed from pole to pole.
Cloud surface_cloud(std::uint64_t points, std::uint64_t seed);
/// Returns uniformly random points in the unit cube.
Cloud uniform_cloud(std::uint64_t seed);
/// Returns blobs of about 1000 points with bell-shaped density and different sizes, one after
/// another, with random centres in the unit cube.
Cloud cluster_cloud(std::uint64_t points, std::uint64_t seed);

/// A shuffled order of 0 ... size - 1 that needs no memory: a Feistel cipher on the next even
/// number of bits, iterated until the result is below size (J. Black, P. Rogaway, Ciphers with
/// Arbitrary Finite Domains, 2002, doi:10.1007/3-540-45760-7_9).
class Permutation {
 public:
  Permutation(std::uint64_t size, std::uint64_t seed);
  /// Requires n < size. Different n give different results.
  [[nodiscard]] std::uint64_t operator()(std::uint64_t n) const;

 private:
  std::uint64_t size_, seed_;
  unsigned half_bits_;
};

/// The order in which points are delivered: the order of generation (""), a random permutation
/// ("all"), or shuffled runs of random length ("pieces:MIN-MAX").
class DeliveryOrder {
 public:
  /// Throws UsageError for any other text, and stream::Error if the table of pieces would need more
  /// than `memory_bytes`.
  DeliveryOrder(const std::string& shuffle, std::uint64_t points, std::uint64_t seed,
                std::uint64_t memory_bytes);
  /// Returns the number of the n-th point delivered. O(log pieces).
  [[nodiscard]] std::uint64_t operator()(std::uint64_t n) const;

 private:
  std::unique_ptr<Permutation> all_;
  std::vector<std::uint64_t> positions_;  ///< delivery position of each piece's first point
  std::vector<std::uint64_t> numbers_;    ///< number of that point, see Cloud
};

}  // namespace terrace::tools
