// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/region_grid.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Polygons prepared for queries. GEOS answers where the grid cannot decide. GEOS's predicates use
/// twice the precision of a double where rounding could matter. Several threads may call all
/// functions at once.
class RegionShape {
 public:
  /// Polygons may overlap each other. Throws: stream::Error if there is no polygon or if one is
  /// invalid by OGC Simple Features, naming `file`, the polygon, the ring and the place;
  /// stream::Stopped.
  RegionShape(std::vector<Polygon> polygons, const std::string& file,
              const std::stop_token& stop = {});
  RegionShape(const RegionShape&) = delete;
  RegionShape& operator=(const RegionShape&) = delete;
  ~RegionShape();

  [[nodiscard]] const std::vector<Polygon>& polygons() const { return polygons_; }
  /// Requires places, boxes and triangles with finite coordinates. A place on a ring is covered.
  [[nodiscard]] bool covers(const Point2& place) const;
  [[nodiscard]] Overlap overlap(const Point2& low, const Point2& high) const;
  /// Whether the closed triangle has a point in common with a polygon.
  [[nodiscard]] bool touches(const std::array<Point2, 3>& triangle) const;

 private:
  class Prepared;

  template <class Ask>
  bool ask(const Ask& question) const;

  std::vector<Polygon> polygons_;
  bool swapped_;  ///< whether GEOS gets y, x
  mutable std::mutex mutex_;
  mutable std::condition_variable idle_changed_;
  mutable std::vector<std::unique_ptr<Prepared>> idle_;
  mutable unsigned count_ = 0;
  RegionGrid grid_;  // its constructor queries the members above
};

/// Returns the part of the plane inside the polygon by the even-odd rule, as valid polygons.
/// Returns the polygon itself if it is valid, and an empty list if it has no area.
std::vector<Polygon> valid_polygons(const Polygon& polygon);

/// Returns why and where a polygon is invalid by OGC Simple Features; nullopt if it is valid.
/// Sweeps over the edges with exact predicates, in O(n log n) for n corners in any arrangement.
/// Source: M. Shamos, D. Hoey, Geometric intersection problems, 1976. Requires finite coordinates
/// and at least one ring. Throws: stream::Stopped.
[[nodiscard]] std::optional<std::string> fault_of(const Polygon& polygon,
                                                  const std::stop_token& stop = {});

}  // namespace terrace::terrain
