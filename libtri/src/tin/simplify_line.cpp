// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "options.hpp"

namespace terrace::tri {
namespace {

using tin::on_lattice;
using tin::round_half_up;
using tin::valid;

void check(std::span<const double> t, std::span<const double> heights, double max_error,
           const std::optional<TinLattice>& lattice) {
  if (t.size() != heights.size())
    throw std::invalid_argument("simplify_line: t and heights must have equal lengths");
  if (!(max_error >= 0)) throw std::invalid_argument("simplify_line: max_error must be at least 0");
  if (lattice && !valid(*lattice))
    throw std::invalid_argument("simplify_line: the lattice's step must be positive");
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (!std::isfinite(t[i]) || !std::isfinite(heights[i]))
      throw std::invalid_argument("simplify_line: sample " + std::to_string(i) + " is not finite");
    if (i > 0 && t[i] < t[i - 1])
      throw std::invalid_argument("simplify_line: sample " + std::to_string(i) +
                                  " is before the previous sample");
  }
}

LineVertex vertex_of(double t, double height, std::size_t sample,
                     const std::optional<TinLattice>& lattice) {
  const auto number = static_cast<std::uint32_t>(sample);
  if (!lattice) return {t, height, number};
  return {round_half_up(t), on_lattice(*lattice, height), number};
}

/// The height of the line at t. Beyond the ends, which rounding may reach, it is the height of the
/// nearer end.
double height_at(const LineVertex& a, const LineVertex& b, double t) {
  if (!(t > a.t)) return a.height;
  if (!(t < b.t)) return b.height;
  return a.height + (b.height - a.height) * ((t - a.t) / (b.t - a.t));
}

/// Samples [first, last) between two vertices.
struct Piece {
  LineVertex from;
  LineVertex to;
  std::size_t first;
  std::size_t last;
};

}  // namespace

SimplifiedLine simplify_line(std::span<const double> t, std::span<const double> heights,
                             double max_error, const std::optional<TinLattice>& lattice,
                             const base::StopCheck& check_stop) {
  check(t, heights, max_error, lattice);
  SimplifiedLine result;
  // The first of several samples at one position represents them.
  std::vector<std::size_t> samples;
  for (std::size_t i = 0; i < t.size(); ++i)
    if (i == 0 || t[i] != t[i - 1]) samples.push_back(i);
  if (samples.empty()) return result;
  const auto vertex = [&](std::size_t k) {
    return vertex_of(t[samples[k]], heights[samples[k]], samples[k], lattice);
  };
  const LineVertex begin = vertex(0);
  const LineVertex end = vertex(samples.size() - 1);
  result.vertices.push_back(begin);
  // Taking the greatest error first splits each piece independently, so the order of pieces does
  // not matter.
  std::vector<Piece> pieces{{begin, end, 0, samples.size()}};
  base::StopTicks ticks(check_stop);
  while (!pieces.empty()) {
    const Piece piece = pieces.back();
    pieces.pop_back();
    ticks(2 * (piece.last - piece.first));
    double worst = 0;
    double worst_free = max_error;
    std::size_t at = samples.size();
    LineVertex middle;
    for (std::size_t k = piece.first; k < piece.last; ++k) {
      const std::size_t i = samples[k];
      const double error = std::abs(height_at(piece.from, piece.to, t[i]) - heights[i]);
      worst = std::max(worst, error);
      if (!(error > worst_free)) continue;
      const LineVertex candidate = vertex(k);
      if (!(candidate.t > piece.from.t && candidate.t < piece.to.t)) continue;
      worst_free = error;
      middle = candidate;
      at = k;
    }
    if (at == samples.size()) {
      result.largest_error = std::max(result.largest_error, worst);
      if (piece.to.t > result.vertices.back().t) result.vertices.push_back(piece.to);
      continue;
    }
    // Rounding may put the vertex on either side of its own sample.
    std::size_t cut = piece.first;
    while (cut < piece.last && t[samples[cut]] <= middle.t) ++cut;
    pieces.push_back({middle, piece.to, cut, piece.last});
    pieces.push_back({piece.from, middle, piece.first, cut});
  }
  return result;
}

}  // namespace terrace::tri
