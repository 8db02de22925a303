// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <terrace/stream/store.hpp>

#include "coordinate_system.hpp"
#include "geoid_heights.hpp"
#include "grid_geography.hpp"
#include "raster_fill.hpp"
#include "store_window.hpp"
#include "tile/height_blocks.hpp"
#include "tile/raster_tile_digest.hpp"
#include "tile/tile_surface.hpp"
#include "world.hpp"

namespace terrace::tools {

/// What all threads know of a raster store that is tiled.
struct TiledRaster {
  const stream::Store& store;
  CoordinateSystem crs;
  Placement placement;
  GridGeography geography;
  EllipsoidalHeights vertical;
  /// Heights where there is no data: nothing takes those around, else this height in metres.
  std::optional<double> flat_fill{};
  /// A sample of this height (in the store's unit) is water; without, one that has no data is.
  std::optional<double> water_height{};

  RasterFill fill;
  HeightBlocks blocks;
  GeographicBox bounds{};
  double spacing = 0.0;
  /// Of a raster in degrees: the longitudes that it gives its samples, which may go beyond 180.
  double first_longitude = 0.0, last_longitude = 0.0;

  /// Reads the store twice. Throws: stream::Error if no place of it can be told on the globe.
  TiledRaster(const stream::Store& tiled, CoordinateSystem system, EllipsoidalHeights heights);
};

/// The surface of a raster store: bilinear between four samples with data, filled elsewhere.
class RasterTileSurface final : public TileSurface {
 public:
  explicit RasterTileSurface(const TiledRaster& raster);

  [[nodiscard]] GeographicBox bounds() const override { return raster_.bounds; }
  [[nodiscard]] double spacing() const override { return raster_.spacing; }
  void expect(const GeographicBox& box) override;
  void samples(const GeographicBox& box, SurfaceSamples& out) override;
  std::optional<HeightRange> range(const GeographicBox& box) override;
  void heights(std::span<const double> longitude, std::span<const double> latitude,
               std::span<double> out) override;
  void water(std::span<const double> longitude, std::span<const double> latitude,
             std::span<std::uint8_t> out) override;
  std::uint64_t digest(const GeographicBox& box) override { return digest_of(raster_, box); }

 private:
  /// Calls visit(i, place on the lattice, the sample north-west of it, distance to the next row)
  /// for each place, in an order that reads little. The sample's right neighbour follows it.
  template <class Visit>
  void visit_places(std::span<const double> longitude, std::span<const double> latitude,
                    const Visit& visit);
  /// Metres above the ellipsoid at a place, of a sample of the lattice or, if it is NaN, of what
  /// fills it.
  [[nodiscard]] double corner_height(const Point2& place, double sample,
                                     const Point2& corner) const;
  /// The heights of a window: of the one that is held, or read into it.
  struct View {
    const double* first = nullptr;
    std::int64_t stride = 0;
  };
  View view(const LatticeWindow& window);
  [[nodiscard]] LatticeWindow window_around(const GeographicBox& box) const;

  const TiledRaster& raster_;
  StoreWindow reader_;
  LatticeWindow held_{};
  std::vector<double> heights_;  ///< of the held window
  std::vector<double> longitude_, latitude_;
};

}  // namespace terrace::tools
