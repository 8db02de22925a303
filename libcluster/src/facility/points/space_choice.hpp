// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <span>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <terrace/base/portable_math.hpp>

#include "facility/points/search_frame.hpp"
#include "facility/points/search_space.hpp"

namespace terrace::cluster {

/// Returns the space of a problem of entities.
inline IndexSpace space_of(const FacilityEntities& problem) {
  return {problem.distance, problem.symmetric && problem.triangle_inequality};
}

/// Calls visit(space) with the space of search_space.hpp that fits the metric of the problem.
/// Returns what `visit` returns. The space is over the points of `frame`, which are moved out of
/// it, and depends on no other object. `original` holds the unscaled points in the order of the
/// frame.
template <class Visit>
auto visit_space(const FacilityPoints& problem, SearchFrame& frame,
                 std::span<const Point3> original, const Visit& visit) {
  using Result = decltype(visit(NormSpace<EuclideanNorm, false>(frame, {}, true)));
  if (linear_map(problem.metric, base::box_of(original))) {
    if (frame.channel_count == 0) return visit(NormSpace<EuclideanNorm, false>(frame, {}, true));
    return visit(NormSpace<EuclideanNorm, true>(frame, {}, true));
  }
  const auto visit_norm = [&](auto norm, bool triangles) -> Result {
    return visit(NormSpace<decltype(norm), true>(frame, norm, triangles));
  };
  return std::visit(
      [&](const auto& metric) -> Result {
        using M = std::decay_t<decltype(metric)>;
        if constexpr (std::is_same_v<M, Minkowski>) {
          if (std::isinf(metric.p)) return visit_norm(MaximumNorm{}, true);
          if (metric.p == 1.0) return visit_norm(CityBlockNorm{}, true);
          return visit_norm(PowerNorm{metric.p}, metric.p >= 1.0);
        } else if constexpr (std::is_same_v<M, EllipticalField>) {
          return visit(FieldSpace(frame, original, metric));
        } else if constexpr (std::is_same_v<M, CustomMetric>) {
          // The caller's function needs original positions. Channels are added under the root.
          auto distance = [points = std::vector<Point3>(original.begin(), original.end()),
                           channels = frame.channels, count = frame.channel_count,
                           function = metric.distance](std::uint32_t j, std::uint32_t i) {
            double d = function(points[j], points[i]);
            for (std::size_t c = 0; c < count && d >= 0.0; ++c) {
              d = base::hypot(d, channels[j * count + c] - channels[i * count + c]);
            }
            return d;
          };
          return visit(
              IndexSpace(std::move(distance), metric.symmetric && metric.triangle_inequality));
        } else {
          return visit_norm(SquaredNorm{}, false);
        }
      },
      problem.metric);
}

}  // namespace terrace::cluster
