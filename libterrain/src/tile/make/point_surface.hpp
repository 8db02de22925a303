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
#include "surface/point_cloud.hpp"
#include "surface/point_surface.hpp"
#include "surface/store_window.hpp"
#include "terrace/terrain/crs.hpp"
#include "tile/make/cloud_samples.hpp"
#include "tile/make/surface.hpp"
#include "tile/make/tiled_store.hpp"

namespace terrace::terrain {

/// The data that all threads share when tiling a store of irregular points.
struct TiledCloud : TiledStore {
  /// Memory limit of a thread for the points of a part, in bytes.
  std::uint64_t window_bytes = 0;
  double rim = 0;  ///< from rim_of_outline()
  /// All samples, if they fit in memory. Otherwise each thread reads the samples of one part at a
  /// time.
  std::unique_ptr<const CloudSamples> samples{};
  std::unique_ptr<PointCloud> points;

  /// Reads a level of the store and a few clusters, or the whole store if it fits in all_bytes.
  /// Throws: stream::Error if no place of it has a longitude and latitude.
  TiledCloud(const stream::Store& tiled, CoordinateSystem system, EllipsoidalHeights heights,
             std::uint64_t window_bytes, std::uint64_t all_bytes, unsigned threads);
};

/// The surface of a store of irregular points: linear on the triangles of their Delaunay
/// triangulation in stored x and y, and filled beyond the hull. Of points at one x and y, only the
/// first in the order of StoreWindow::points() is a sample.
class PointTileSurface final : public TileSurface {
 public:
  explicit PointTileSurface(const TiledCloud& cloud);

  void check_stop() const override { cloud_.store.check_stop(); }
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
  /// Hashes the whole store, because a point changes the triangles around it, and possibly a
  /// distant part of the hull.
  std::uint64_t digest(const GeographicBox& box) override;

 private:
  /// Returns windows of the store for the most recently requested box.
  const std::vector<StoredBox>& windows(const GeographicBox& box);
  /// Computes heights in the store's vertical unit at stored places; NaN beyond the hull.
  void surface_heights(std::span<const Point2> stored, std::span<double> out);
  void part_heights(std::span<const Point2> stored, std::span<std::uint32_t> part,
                    std::span<double> out);
  void load(const StoredBox& box);
  bool holds(const StoredBox& box) const;
  bool counts_as_crowded(const GeographicBox& box);
  /// Approximate number of points in the window, see stream::StoreQuery::estimate().
  double estimate(const StoredBox& window, double limit) {
    return reader_.query().estimate(tall(window), limit);
  }
  /// Keeps only the first of points at one x and y, in order.
  void drop_duplicates();

  const TiledCloud& cloud_;
  StoreWindow reader_;
  PointSurface surface_;
  bool has_all_ = false;                        ///< whether all points are in memory
  std::optional<StoredBox> loaded_, expected_;  ///< the loaded box, and the one to load
  std::optional<GeographicBox> requested_;
  std::vector<StoredBox> windows_;
  WindowPoints points_;
  std::vector<std::uint32_t> slots_;
  std::map<std::array<double, 4>, bool> crowded_;  ///< known results of crowded()
};

}  // namespace terrace::terrain
