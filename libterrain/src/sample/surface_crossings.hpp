// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include <terrace/stream/store.hpp>

#include "surface/point_window.hpp"
#include "surface/window_tree.hpp"
#include "terrace/terrain/heights.hpp"

namespace terrace::terrain {

/// Where a line meets the edges of the triangulation of a store's points (see PointWindow): between
/// two such places the linear surface is straight.
class SurfaceCrossings {
 public:
  struct Crossing {
    double t = 0;     ///< of the way, between 0 and 1
    Point2 place{};   ///< stored
    double height{};  ///< of the linear surface; NaN on edges longer than SamplerOptions::max_edge
  };

  /// The level, the memory and max_edge count. The store must outlive this.
  SurfaceCrossings(const stream::Store& store, const SamplerOptions& options,
                   std::uint64_t memory_bytes);

  /// Calls visit for each crossing between `from` and `to` (stored), in their order, a vertex once;
  /// those closer than 1e-12 of the way are one. Which sides of the line the ends of an edge lie on
  /// is decided exactly, so none is missed. Windows of the store are read one after another along
  /// the line. Throws: stream::Error, stream::Stopped.
  void operator()(const Point2& from, const Point2& to,
                  const std::function<void(const Crossing&)>& visit);

 private:
  void collect(const Point2& from, const Point2& to, double begin, double end, bool is_last);

  const stream::Store& store_;
  WindowTree tree_;
  TooLong too_long_;
  PointWindow window_;
  std::vector<Crossing> found_;
};

}  // namespace terrace::terrain
