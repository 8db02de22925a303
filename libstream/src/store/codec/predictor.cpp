// SPDX-License-Identifier: Apache-2.0
#include "store/codec/predictor.hpp"

#include <algorithm>
#include <cmath>

namespace terrace::stream::store {
namespace {

constexpr std::int32_t kUnit = 256;
constexpr std::int32_t kMaxCoefficient = 16 * kUnit;
/// Fewer samples than this do not justify separate coefficients.
constexpr std::uint64_t kMinSamples = 64;

/// Returns the neighbour from which the others are measured, the lowest of the pattern.
unsigned reference(unsigned pattern) { return static_cast<unsigned>(std::countr_zero(pattern)); }

}  // namespace

std::array<Predictor::Coefficients, kPatterns> Predictor::defaults() {
  std::array<Coefficients, kPatterns> result{};
  for (unsigned pattern = 1; pattern < kPatterns; ++pattern) {
    const auto exists = [&](unsigned n) { return (pattern >> n & 1) != 0; };
    Coefficients& c = result[pattern];
    if (exists(kWest) && exists(kNorth) && exists(kNorthWest)) {
      c[kWest] = c[kNorth] = kUnit;
      c[kNorthWest] = -kUnit;
    } else {
      c[reference(pattern)] = kUnit;
    }
  }
  return result;
}

void Predictor::write(Bytes& out) const {
  const auto standard = defaults();
  std::uint64_t fitted = 0;
  for (unsigned p = 1; p < kPatterns; ++p) {
    if (coefficients[p] != standard[p]) fitted |= std::uint64_t{1} << p;
  }
  put(out, fitted);
  for (unsigned p = 1; p < kPatterns; ++p) {
    if ((fitted >> p & 1) == 0) continue;
    for (unsigned n = reference(p) + 1; n < kNeighbours; ++n) {
      if (p >> n & 1) put_varint(out, zigzag(coefficients[p][n]));
    }
  }
}

Predictor Predictor::read(ByteReader& in) {
  Predictor predictor;
  const auto fitted = in.get<std::uint64_t>();
  if (fitted & 1) throw Damage("a predictor without neighbours has coefficients");
  for (unsigned p = 1; p < kPatterns; ++p) {
    if ((fitted >> p & 1) == 0) continue;
    Coefficients c{};
    std::int32_t rest = kUnit;
    for (unsigned n = reference(p) + 1; n < kNeighbours; ++n) {
      if ((p >> n & 1) == 0) continue;
      const std::int64_t value = unzigzag(in.varint());
      if (value < -kMaxCoefficient || value > kMaxCoefficient)
        throw Damage("a predictor's coefficient is out of range");
      c[n] = static_cast<std::int32_t>(value);
      rest -= c[n];
    }
    c[reference(p)] = rest;
    predictor.coefficients[p] = c;
  }
  return predictor;
}

void PredictorFit::add(unsigned pattern, std::int64_t value,
                       const std::array<std::int64_t, kNeighbours>& neighbours) {
  if (pattern == 0) return;
  const unsigned base = reference(pattern);
  const auto difference = [&](std::int64_t v) {
    return static_cast<double>(static_cast<std::int64_t>(
        static_cast<std::uint64_t>(v) - static_cast<std::uint64_t>(neighbours[base])));
  };
  std::array<double, kUnknowns> x{};
  unsigned unknowns = 0;
  for (unsigned n = base + 1; n < kNeighbours; ++n) {
    if (pattern >> n & 1) x[unknowns++] = difference(neighbours[n]);
  }
  const double y = difference(value);
  Sums& sums = sums_[pattern];
  ++sums.count;
  for (unsigned i = 0; i < unknowns; ++i) {
    for (unsigned j = 0; j <= i; ++j) sums.products[i][j] += x[i] * x[j];
    sums.targets[i] += x[i] * y;
  }
}

Predictor PredictorFit::fit() const {
  Predictor predictor;
  for (unsigned pattern = 1; pattern < kPatterns; ++pattern) {
    const Sums& sums = sums_[pattern];
    if (sums.count < kMinSamples) continue;
    const auto unknowns = static_cast<unsigned>(std::popcount(pattern)) - 1;

    // Cholesky decomposition; the small addition to the diagonal keeps flat land solvable.
    auto lower = sums.products;
    auto solution = sums.targets;
    double trace = 0;
    for (unsigned i = 0; i < unknowns; ++i) trace += lower[i][i];
    bool solvable = trace > 0;
    for (unsigned i = 0; i < unknowns && solvable; ++i) {
      lower[i][i] += 1e-6 * trace;
      for (unsigned j = 0; j <= i; ++j) {
        double sum = lower[i][j];
        for (unsigned k = 0; k < j; ++k) sum -= lower[i][k] * lower[j][k];
        if (i != j) {
          lower[i][j] = sum / lower[j][j];
        } else if (sum > 0) {
          lower[i][i] = std::sqrt(sum);
        } else {
          solvable = false;
        }
      }
    }
    if (!solvable) continue;
    for (unsigned i = 0; i < unknowns; ++i) {
      for (unsigned k = 0; k < i; ++k) solution[i] -= lower[i][k] * solution[k];
      solution[i] /= lower[i][i];
    }
    for (unsigned i = unknowns; i-- > 0;) {
      for (unsigned k = i + 1; k < unknowns; ++k) solution[i] -= lower[k][i] * solution[k];
      solution[i] /= lower[i][i];
    }

    Predictor::Coefficients c{};
    std::int32_t rest = kUnit;
    unsigned next = 0;
    bool usable = true;
    for (unsigned n = reference(pattern) + 1; n < kNeighbours; ++n) {
      if ((pattern >> n & 1) == 0) continue;
      const double scaled = std::nearbyint(solution[next++] * kUnit);
      if (!(std::abs(scaled) <= kMaxCoefficient)) {
        usable = false;
        break;
      }
      c[n] = static_cast<std::int32_t>(scaled);
      rest -= c[n];
    }
    if (!usable) continue;
    c[reference(pattern)] = rest;
    predictor.coefficients[pattern] = c;
  }
  return predictor;
}

}  // namespace terrace::stream::store
