// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <terrace/stream/store.hpp>

#include "base/large_array.hpp"
#include "earth/geoid_heights.hpp"
#include "surface/point_cells.hpp"
#include "tile/make/stored_places.hpp"
#include "tile/make/surface.hpp"

namespace terrace::terrain {

/// The samples of a cloud that fits in memory, with their places on the globe. These are computed
/// once, because tiles of every zoom need all samples. Of points at one x and y, uses the first in
/// the order of StoreWindow::points(). Several threads may call const members at once.
class CloudSamples {
 public:
  static constexpr std::uint64_t kBytesPerPoint = PointCells::kBytesPerPoint;

  /// Throws: stream::Error on a damaged store, stream::Stopped.
  CloudSamples(const stream::Store& store, const StoredPlaces& places,
               const EllipsoidalHeights& vertical, unsigned threads);

  /// The samples in stored coordinates.
  [[nodiscard]] const PointCells& cells() const { return cells_; }
  /// Whether the samples are crowded into few cells.
  [[nodiscard]] bool crowd() const { return crowd_; }

  /// Adds the points of `window` (stored coordinates) that are in `box`.
  void add(const StoredBox& window, const GeographicBox& box, SurfaceSamples& out) const;

 private:
  struct Sample {
    double longitude, latitude, height;
  };

  PointCells cells_;
  bool crowd_;
  LargeArray<Sample> samples_;  ///< of cells_.positions()
};

/// Returns the typical spacing of a store's points in degrees of latitude: the spacing of a square
/// lattice with the density around the median point. Estimated from the points in and around 32
/// clusters; points at one x and y count once. If all are at one place, returns 180 / 64. Throws:
/// stream::Error on a damaged store.
double cloud_spacing(const stream::Store& store, const StoredPlaces& places);

}  // namespace terrace::terrain
