// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "surface/store_window.hpp"
#include "tile/make/surface.hpp"
#include "tile/make/tiled_raster.hpp"

namespace terrace::terrain {

/// The surface of a raster store: bilinear between four samples with data, filled elsewhere.
/// Memory: 12 MiB, and 8 bytes per sample of the largest requested box, or 24 for samples().
class RasterTileSurface : public TileSurface {
 public:
  explicit RasterTileSurface(const TiledRaster& raster);

  void check_stop() const override { raster_.store.check_stop(); }
  [[nodiscard]] GeographicBox bounds() const override { return raster_.places.bounds(); }
  [[nodiscard]] double spacing() const override { return raster_.spacing; }
  void expect(const GeographicBox& box) override;
  void samples(const GeographicBox& box, SurfaceSamples& out) override;
  SurfacePart part(const GeographicBox& box) override;
  std::optional<HeightRange> range(const GeographicBox& box) override;
  [[nodiscard]] double height_beyond() const override { return raster_.height_beyond(); }
  std::optional<HeightRange> surface_range(const GeographicBox& box) override;
  void heights(std::span<const double> longitude, std::span<const double> latitude,
               std::span<double> out) override;
  void water(std::span<const double> longitude, std::span<const double> latitude,
             std::span<std::uint8_t> out) override;
  std::uint64_t digest(const GeographicBox& box) override { return raster_.digest(box); }

 private:
  [[nodiscard]] HeightRange above_ellipsoid(const HeightBlocks::Range& range, bool filled) const;
  /// The raster's window around a box, cached: range, expectation and part of a leaf use the same
  /// one, and computing it may take hundreds of conversions.
  const LatticeWindow& window_around(const GeographicBox& box);
  /// Returns false if the samples are not in rows along parallels.
  bool rows(const GeographicBox& box, SurfaceRows& out);
  void grid(const GeographicBox& box, const LatticeWindow& window, SurfaceGrid& out);
  /// Calls visit(i, place on the lattice, the sample north-west of it, distance to the next row)
  /// for each place, in an order that reads little. The sample's right neighbour follows it.
  template <class Visit>
  void visit_places(std::span<const double> longitude, std::span<const double> latitude,
                    const Visit& visit);
  /// The heights of a window, which are part of the loaded window or are read.
  struct View {
    const double* first = nullptr;
    std::int64_t stride = 0;
  };
  View view(const LatticeWindow& window);

  const TiledRaster& raster_;
  StoreWindow reader_;
  std::optional<std::pair<GeographicBox, LatticeWindow>> around_;  ///< the most recent
  LatticeWindow loaded_{};
  std::vector<double> heights_;  ///< heights of the loaded window
  std::vector<Point2> places_;   ///< places to evaluate the geoid at
  std::vector<double> geoid_shares_;
  std::vector<std::size_t> filled_;  ///< samples of a grid that get the flat fill
  SurfaceGrid grid_;
};

}  // namespace terrace::terrain
