// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/least_error.hpp"

#include <algorithm>
#include <cmath>

#include <terrace/base/portable_math.hpp>

namespace terrace::tri {
namespace {

constexpr double kLeastStep = 1.002;  // ratio below which two bounds count as equal

/// A bound that was tried, and its number of vertices.
struct Tried {
  double bound = 0.0, vertices = 0.0;
  bool known = false;
};

/// The bounds closest to the wanted one, on either side.
class Bracket {
 public:
  Bracket(double wanted, const LeastErrorSearch& search)
      : wanted_(wanted), least_(search.least), range_(search.range) {}

  void add(double bound, double vertices, bool few) {
    (few ? few_ : many_) = {bound, vertices, true};
    in_a_row_ = few == last_few_ ? in_a_row_ + 1 : 1;
    last_few_ = few;
  }

  [[nodiscard]] const Tried& few() const { return few_; }
  [[nodiscard]] bool narrow() const {
    return few_.known && many_.known && few_.bound <= many_.bound * kLeastStep;
  }

  /// The next bound to try. Numbers of vertices fall about as a power of the bound between 1 and 2,
  /// so the logarithms are interpolated linearly between two known bounds. If the search has
  /// repeatedly moved the same one, takes the middle.
  [[nodiscard]] double next() const {
    if (!few_.known) return std::min(range_, std::max(4.0 * many_.bound, 1e-4 * range_));
    if (!many_.known) {
      if (few_.bound < 1e-6 * range_) return least_;
      const double by_power = few_.bound * base::exp(base::log(few_.vertices / wanted_) / 1.5);
      return inside(
          std::clamp(by_power, few_.bound / 64.0, few_.bound / (in_a_row_ < 2 ? 1.05 : 4.0)));
    }
    if (many_.bound <= 0.0) return few_.bound / 4.0;
    const double width = base::log(few_.bound / many_.bound);
    const double fall = base::log(many_.vertices / few_.vertices);
    double part = 0.5;
    if (in_a_row_ < 3 && fall > 0.0) part = base::log(many_.vertices / wanted_) / fall;
    return inside(many_.bound * base::exp(width * part));
  }

  /// The nearest bound strictly between the known ones.
  [[nodiscard]] double inside(double bound) const {
    if (few_.known) bound = std::min(bound, few_.bound / kLeastStep);
    if (many_.known) bound = std::max(bound, many_.bound * kLeastStep);
    if (few_.known && many_.known && bound >= few_.bound)
      bound = std::sqrt(few_.bound * many_.bound);
    return std::clamp(bound, least_, range_);
  }

 private:
  double wanted_, least_, range_;
  Tried few_, many_;
  bool last_few_ = false;
  int in_a_row_ = 0;
};

/// A bound at which the estimate times `factor` is about `wanted`, searched from `start`.
double by_estimate(const LeastErrorSearch& search, double wanted, double factor, double start) {
  constexpr int kMost = 12;
  Bracket bracket(wanted, search);
  double bound = start;
  for (int i = 0; i < kMost; ++i) {
    const double vertices = std::max(factor * search.estimate(bound), 1.0);
    const bool few = vertices <= wanted;
    bracket.add(bound, vertices, few);
    if (std::fabs(vertices / wanted - 1.0) < 0.004 || bracket.narrow()) break;
    if ((few && bound <= search.least) || (!few && bound >= search.range)) break;
    bound = bracket.next();
  }
  return bound;
}

}  // namespace

bool least_error(const LeastErrorSearch& search) {
  constexpr int kMostRuns = 24, kRunsByEstimate = 4;
  const auto most = static_cast<double>(search.most);
  const double wanted = 0.99 * most;
  Bracket bracket(wanted, search);
  double bound = std::max(search.least, search.range / 64.0);
  if (search.estimate) bound = by_estimate(search, wanted, 1.0, bound);
  double last = bound;
  for (int i = 0; i < kMostRuns; ++i) {
    last = bound;
    const double vertices = search.run(bound);
    const bool few = vertices <= most;
    if (few && (bound <= search.least || vertices >= 0.98 * most)) return true;
    if (!few && bound >= search.range) return false;
    bracket.add(bound, vertices, few);
    if (bracket.narrow()) break;
    if (search.estimate && i + 1 < kRunsByEstimate && bound > 0.0) {
      const double factor = vertices / std::max(search.estimate(bound), 1.0);
      const double better = bracket.inside(by_estimate(search, wanted, factor, bound));
      if (better != bound) {
        bound = better;
        continue;
      }
    }
    bound = bracket.next();
  }
  if (!bracket.few().known) return false;
  if (last != bracket.few().bound) search.run(bracket.few().bound);
  return true;
}

}  // namespace terrace::tri
