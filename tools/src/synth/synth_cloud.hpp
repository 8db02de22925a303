// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "terrace/stream/point.hpp"

namespace terrace::tools {

/// A synthetic cloud: its n-th point, which depends on n and the seed alone, so points can be made
/// in any order and by any number of threads. Coordinates are whole multiples of a unit (1 mm or
/// 10^-6), as the decimals of real scans are. The same doubles on every machine.
using Cloud = std::function<stream::Point3(std::uint64_t n)>;

/// A scan of a bumpy closed surface of about 100 m radius: swaths of 500 points across, line by
/// line around the body, each swath nearer to the other pole.
Cloud surface_cloud(std::uint64_t points, std::uint64_t seed);
/// Uniform random points in the unit cube.
Cloud uniform_cloud(std::uint64_t seed);
/// Blobs of about 1000 points with bell-shaped density, one after the other, of
/// different sizes, with random centres in the unit cube.
Cloud cluster_cloud(std::uint64_t points, std::uint64_t seed);

/// A shuffled order of 0 ... size - 1 that needs no memory: a Feistel cipher on the next even
/// number of bits, walked until it falls below size (J. Black, P. Rogaway, Ciphers with Arbitrary
/// Finite Domains, 2002, doi:10.1007/3-540-45760-7_9).
class Permutation {
 public:
  Permutation(std::uint64_t size, std::uint64_t seed);
  /// Requires n < size. Different n give different results.
  [[nodiscard]] std::uint64_t operator()(std::uint64_t n) const;

 private:
  std::uint64_t size_, seed_;
  unsigned half_bits_;
};

/// In which order points are delivered: "" as made, "all" every point shuffled, "pieces:MIN-MAX"
/// runs of random length as made, the runs shuffled.
class DeliveryOrder {
 public:
  /// Throws: UsageError for another text; stream::Error if the pieces' table would need more than
  /// `memory_bytes`.
  DeliveryOrder(const std::string& shuffle, std::uint64_t points, std::uint64_t seed,
                std::uint64_t memory_bytes);
  /// The number of the point that is delivered n-th. O(log pieces).
  [[nodiscard]] std::uint64_t operator()(std::uint64_t n) const;

 private:
  std::unique_ptr<Permutation> all_;
  std::vector<std::uint64_t> delivered_;  ///< place of each piece's first point in the delivery
  std::vector<std::uint64_t> made_;       ///< its number in the order as made
};

}  // namespace terrace::tools
