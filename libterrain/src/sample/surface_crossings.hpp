// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "sample/samplers.hpp"
#include "surface/point_window.hpp"
#include "terrace/terrain/heights.hpp"

namespace terrace::terrain {

/// Finds the places where a line crosses edges of the triangulation of a store's points (see
/// PointWindow). The linear surface is straight between these places.
class SurfaceCrossings {
 public:
  struct Crossing {
    double t = 0;     ///< position along the line, between 0 and 1
    Point2 place{};   ///< stored
    double height{};  ///< of the linear surface; NaN on edges longer than SamplerOptions::max_edge
  };

  /// Uses the max_edge of the options.
  SurfaceCrossings(std::shared_ptr<SampledCloud> sampled, const SamplerOptions& options,
                   std::uint64_t memory_bytes);

  /// Calls visit for each crossing between stored places `from` and `to`, in order, once per
  /// vertex; crossings closer than 1e-12 of the line are one. Exact predicates decide on which side
  /// of the line the ends of an edge are, so no crossing is missed. Reads windows of the store one
  /// after another along the line. Throws: stream::Error, stream::Stopped.
  void operator()(const Point2& from, const Point2& to,
                  const std::function<void(const Crossing&)>& visit);

 private:
  void collect(const Point2& from, const Point2& to, double begin, double end, bool is_last);

  std::shared_ptr<SampledCloud> sampled_;
  TooLong too_long_;
  PointWindow window_;
  std::vector<Crossing> found_;
};

}  // namespace terrace::terrain
