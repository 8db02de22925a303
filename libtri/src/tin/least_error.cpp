// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/least_error.hpp"

#include <algorithm>
#include <cmath>

#include <terrace/base/portable_math.hpp>

namespace terrace::tri {
namespace {

constexpr double kMinStep = 1.002;  // ratio below which two bounds count as equal

/// A bound that was tried and its number of vertices.
struct Trial {
  double bound = 0.0, vertices = 0.0;
  bool is_set = false;
};

/// The bounds closest to the target, with fewer and with more vertices than it.
class Bracket {
 public:
  Bracket(double target, const LeastErrorSearch& search)
      : target_(target), least_(search.least), range_(search.range) {}

  void add(double bound, double vertices, bool is_below) {
    (is_below ? below_ : above_) = {bound, vertices, true};
    moves_in_a_row_ = is_below == was_below_ ? moves_in_a_row_ + 1 : 1;
    was_below_ = is_below;
  }

  [[nodiscard]] const Trial& below() const { return below_; }
  [[nodiscard]] bool is_narrow() const {
    return below_.is_set && above_.is_set && below_.bound <= above_.bound * kMinStep;
  }

  /// The next bound to try. Numbers of vertices fall about as a power of the bound between 1 and 2,
  /// so the logarithms are interpolated linearly between two known bounds. If the search has
  /// repeatedly moved the same one, takes the middle.
  [[nodiscard]] double next() const {
    if (!below_.is_set) return std::min(range_, std::max(4.0 * above_.bound, 1e-4 * range_));
    if (!above_.is_set) {
      if (below_.bound < 1e-6 * range_) return least_;
      const double by_power = below_.bound * base::exp(base::log(below_.vertices / target_) / 1.5);
      return inside(std::clamp(by_power, below_.bound / 64.0,
                               below_.bound / (moves_in_a_row_ < 2 ? 1.05 : 4.0)));
    }
    if (above_.bound <= 0.0) return below_.bound / 4.0;
    const double width = base::log(below_.bound / above_.bound);
    const double fall = base::log(above_.vertices / below_.vertices);
    double part = 0.5;
    if (moves_in_a_row_ < 3 && fall > 0.0) part = base::log(above_.vertices / target_) / fall;
    return inside(above_.bound * base::exp(width * part));
  }

  /// The nearest bound strictly between the known ones.
  [[nodiscard]] double inside(double bound) const {
    if (below_.is_set) bound = std::min(bound, below_.bound / kMinStep);
    if (above_.is_set) bound = std::max(bound, above_.bound * kMinStep);
    if (below_.is_set && above_.is_set && bound >= below_.bound)
      bound = std::sqrt(below_.bound * above_.bound);
    return std::clamp(bound, least_, range_);
  }

 private:
  double target_, least_, range_;
  Trial below_, above_;
  bool was_below_ = false;
  int moves_in_a_row_ = 0;
};

/// A bound at which the estimate times `factor` is about `target`, searched from `start`.
double bound_by_estimate(const LeastErrorSearch& search, double target, double factor,
                         double start) {
  constexpr int kMaxTrials = 12;
  Bracket bracket(target, search);
  double bound = start;
  for (int i = 0; i < kMaxTrials; ++i) {
    const double vertices = std::max(factor * search.estimate(bound), 1.0);
    const bool is_below = vertices <= target;
    bracket.add(bound, vertices, is_below);
    if (std::fabs(vertices / target - 1.0) < 0.004 || bracket.is_narrow()) break;
    if ((is_below && bound <= search.least) || (!is_below && bound >= search.range)) break;
    bound = bracket.next();
  }
  return bound;
}

}  // namespace

bool least_error(const LeastErrorSearch& search) {
  constexpr int kMaxRuns = 24, kRunsByEstimate = 4;
  const auto limit = static_cast<double>(search.max_vertices);
  const double target = 0.99 * limit;
  Bracket bracket(target, search);
  double bound = std::max(search.least, search.range / 64.0);
  if (search.estimate) bound = bound_by_estimate(search, target, 1.0, bound);
  double last = bound;
  for (int i = 0; i < kMaxRuns; ++i) {
    last = bound;
    const double vertices = search.run(bound);
    const bool is_below = vertices <= limit;
    if (is_below && (bound <= search.least || vertices >= 0.98 * limit)) return true;
    if (!is_below && bound >= search.range) return false;
    bracket.add(bound, vertices, is_below);
    if (bracket.is_narrow()) break;
    if (search.estimate && i + 1 < kRunsByEstimate && bound > 0.0) {
      const double factor = vertices / std::max(search.estimate(bound), 1.0);
      const double refined = bracket.inside(bound_by_estimate(search, target, factor, bound));
      if (refined != bound) {
        bound = refined;
        continue;
      }
    }
    bound = bracket.next();
  }
  if (!bracket.below().is_set) return false;
  if (last != bracket.below().bound) search.run(bracket.below().bound);
  return true;
}

}  // namespace terrace::tri
