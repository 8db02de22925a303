// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "store/codec/bytes.hpp"

/// Predicts a height from already known neighbours by a linear combination. Its coefficients (in
/// 1/256, adding up to 256) are fitted by least squares, one set for each of the 64 possible
/// patterns of neighbours.

namespace terrace::stream::store {

/// The neighbours. Bit i of a pattern is set if neighbour i exists.
enum Neighbour : unsigned { kWest, kNorth, kNorthWest, kNorthEast, kWestWest, kNorthNorth };
inline constexpr unsigned kNeighbours = 6;
inline constexpr unsigned kPatterns = 1u << kNeighbours;

/// The coefficients of all patterns.
struct Predictor {
  using Coefficients = std::array<std::int32_t, kNeighbours>;
  std::array<Coefficients, kPatterns> coefficients = defaults();

  /// Returns coefficients of a plane if three neighbours span one, otherwise of the nearest
  /// neighbour. Pattern 0 has none.
  static std::array<Coefficients, kPatterns> defaults();

  void write(Bytes& out) const;
  /// Parses the coefficients. Throws: Damage.
  static Predictor read(ByteReader& in);
};

/// Accumulates the sums of the least squares. All arithmetic is in a fixed order.
class PredictorFit {
 public:
  PredictorFit() : sums_(kPatterns) {}

  void add(unsigned pattern, std::int64_t value,
           const std::array<std::int64_t, kNeighbours>& neighbours);
  [[nodiscard]] Predictor fit() const;

 private:
  static constexpr unsigned kUnknowns = kNeighbours - 1;
  struct Sums {
    std::uint64_t count = 0;
    std::array<std::array<double, kUnknowns>, kUnknowns> products{};
    std::array<double, kUnknowns> targets{};
  };
  std::vector<Sums> sums_;
};

}  // namespace terrace::stream::store
