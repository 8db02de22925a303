// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <terrace/stream/store.hpp>

#include "earth/geoid_heights.hpp"
#include "surface/point_hull.hpp"
#include "surface/point_surface.hpp"
#include "surface/point_window.hpp"
#include "surface/store_window.hpp"
#include "terrace/terrain/crs.hpp"
#include "tile/make/cloud_samples.hpp"
#include "tile/make/tile_surface.hpp"
#include "tile/make/tiled_store.hpp"

namespace terrace::terrain {

/// What all threads share of a store of irregular points that is tiled.
struct TiledCloud : TiledStore {
  /// Memory that a thread may use for the triangles of a part.
  std::uint64_t window_bytes = 0;
  PointHull hull;
  double rim = 0;  ///< see rim_of_outline()
  /// All, if they fit into memory; else each thread reads those of a part at a time.
  std::unique_ptr<const CloudSamples> samples{};
  /// All triangles, for samples that crowd, if they fit as well.
  std::unique_ptr<const PointWindow> whole{};
  /// Shared by the windows of all threads.
  std::shared_ptr<PointVoids> voids{};

  /// Reads a level of the store, and a few clusters; all of it where it fits into whole_bytes.
  /// Throws: stream::Error if no place of it has a longitude and latitude.
  TiledCloud(const stream::Store& tiled, CoordinateSystem system, EllipsoidalHeights heights,
             std::uint64_t window_bytes, std::uint64_t whole_bytes, unsigned threads);
};

/// The surface of a store of irregular points: linear in the triangles of the Delaunay
/// triangulation of all of them by stored x, y, filled beyond their hull. Of points at one x, y the
/// first in the order of StoreWindow::points() counts, and the others are not samples.
class PointTileSurface final : public TileSurface {
 public:
  explicit PointTileSurface(const TiledCloud& cloud);

  [[nodiscard]] GeographicBox bounds() const override { return cloud_.places.bounds(); }
  [[nodiscard]] double spacing() const override { return cloud_.spacing; }
  void expect(const GeographicBox& box) override;
  [[nodiscard]] double widest_part() const override { return 360.0; }
  bool crowded(const GeographicBox& box) override;
  [[nodiscard]] double height_beyond() const override { return cloud_.height_beyond(); }
  [[nodiscard]] bool sides_take_samples() const override { return true; }
  void samples(const GeographicBox& box, SurfaceSamples& out) override;
  std::optional<HeightRange> range(const GeographicBox& box) override;
  void heights(std::span<const double> longitude, std::span<const double> latitude,
               std::span<double> out) override;
  void water(std::span<const double> longitude, std::span<const double> latitude,
             std::span<std::uint8_t> out) override;
  /// Depends on the whole store: a point changes the triangles around it, and the hull far away.
  std::uint64_t digest(const GeographicBox& box) override;

 private:
  /// Windows of the store for the box that was asked for last.
  const std::vector<StoredBox>& windows(const GeographicBox& box);
  /// In the store's vertical unit, by the stored places; NaN beyond the hull.
  void surface_heights(std::span<const Point2> stored, std::span<double> out);
  void part_heights(std::span<const Point2> stored, std::span<std::uint32_t> part,
                    std::span<double> out);
  bool holds(const StoredBox& box) const;
  bool counts_as_crowded(const GeographicBox& box);
  /// About the number of points in the window, see stream::StoreQuery::estimate().
  double estimate(const StoredBox& window, double limit) {
    return reader_.query().estimate(tall(window), limit);
  }
  /// Leaves the first of points at one x, y, in their order.
  void drop_duplicates();

  const TiledCloud& cloud_;
  StoreWindow reader_;
  /// Between all samples, if they are in memory and do not crowd, nor lie on one line.
  std::optional<PointSurface> surface_;
  PointWindow window_;                        ///< of a part
  std::optional<StoredBox> held_, expected_;  ///< what the window holds, and is to hold
  std::optional<GeographicBox> asked_;
  std::vector<StoredBox> windows_;
  WindowPoints points_;
  std::vector<std::uint32_t> slots_;
  std::map<std::array<double, 4>, bool> crowded_;  ///< what is known of boxes
};

}  // namespace terrace::terrain
