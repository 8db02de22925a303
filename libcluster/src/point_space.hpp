// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "cost_rows.hpp"
#include "fast_distances.hpp"
#include "search_frame.hpp"
#include "search_space.hpp"

namespace terrace::cluster {

/// Calls visit(space) with the distances of the problem among the points of its frame, which
/// are moved out of it. `original` are the points in the order of the frame's.
template <class Visit>
auto with_space(const FacilityPoints& problem, SearchFrame& frame, std::span<const Point3> original,
                const Visit& visit) {
  using Result = decltype(visit(NormSpace<EuclideanNorm, false>(frame, {}, true)));
  if (linear_map(problem.metric, bounds_of(original))) {
    if (frame.channel_count == 0) return visit(NormSpace<EuclideanNorm, false>(frame, {}, true));
    return visit(NormSpace<EuclideanNorm, true>(frame, {}, true));
  }
  const auto with_norm = [&](auto norm) -> Result {
    return visit(NormSpace<decltype(norm), true>(frame, norm, false));
  };
  return std::visit(
      [&](const auto& metric) -> Result {
        using M = std::decay_t<decltype(metric)>;
        if constexpr (std::is_same_v<M, Minkowski>) {
          if (std::isinf(metric.p)) return with_norm(MaximumNorm{});
          if (metric.p == 1.0) return with_norm(CityBlockNorm{});
          return with_norm(PowerNorm{metric.p});
        } else if constexpr (std::is_same_v<M, EllipticalField>) {
          return visit(FieldSpace(frame, original, metric));
        } else if constexpr (std::is_same_v<M, CustomMetric>) {
          // The caller's function on positions as they are; channels join under the root.
          auto distance = [original, channels = frame.channels, count = frame.channel_count,
                           function = metric.distance](std::uint32_t j, std::uint32_t i) {
            double d = function(original[j], original[i]);
            for (std::size_t c = 0; c < count && d >= 0.0; ++c) {
              d = std::hypot(d, channels[j * count + c] - channels[i * count + c]);
            }
            return d;
          };
          return visit(IndexSpace(std::move(distance), false));
        } else {
          return with_norm(SquaredNorm{});
        }
      },
      problem.metric);
}

/// How far costs of the frame, summed over all clients, may be from those of the given coordinates:
/// bringing coordinates into range and mapping them rounds by units in the last place of the box,
/// also where the distance is short.
[[nodiscard]] double rounding_of_frame(const FacilityPoints& problem, const SearchFrame& frame);

/// Weighted distances, worked out row by row; nobody pays more than the price of being left out.
template <class Space>
class PointRows final : public CostRows {
 public:
  PointRows(const Space& space, std::span<const double> weights, double price)
      : CostRows(weights.size(), weights.size()),
        space_(&space),
        distances_(space),
        weights_(weights),
        price_(price) {}

  const double* row(std::size_t facility, std::vector<double>& scratch) const override {
    const auto count = static_cast<std::uint32_t>(clients());
    scratch.resize(count);
    distances_.from(static_cast<std::uint32_t>(facility)).fill(count, scratch.data());
    for (std::uint32_t i = 0; i < count; ++i) {
      scratch[i] = weights_[i] * std::min(scratch[i], price_);
    }
    return scratch.data();
  }
  void gather(std::size_t facility, std::span<const std::uint32_t> which,
              double* out) const override {
    const auto from = space_->from(static_cast<std::uint32_t>(facility));
    for (std::size_t k = 0; k < which.size(); ++k) {
      out[k] = weights_[which[k]] * std::min(from(which[k]), price_);
    }
  }

 private:
  const Space* space_;
  FastDistances<Space> distances_;
  std::span<const double> weights_;
  double price_;
};

}  // namespace terrace::cluster
