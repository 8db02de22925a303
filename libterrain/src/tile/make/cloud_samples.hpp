// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <terrace/stream/store.hpp>

#include "earth/geoid_heights.hpp"
#include "surface/store_window.hpp"
#include "tile/make/stored_places.hpp"
#include "tile/make/tile_surface.hpp"

namespace terrace::terrain {

/// The samples of a cloud that fits into memory, placed on the globe once: tiles of every zoom ask
/// for all of them. Of points at one x, y the first in the order of StoreWindow::points() counts.
/// Const members may be called by several threads at once.
class CloudSamples {
 public:
  static constexpr std::uint64_t kBytesPerPoint = 36;

  /// Reads the store twice. Throws: stream::Error on a damaged store, stream::Stopped.
  CloudSamples(const stream::Store& store, const StoredPlaces& places,
               const EllipsoidalHeights& vertical, unsigned threads);

  /// Adds those in `box` of the points in `window` (stored coordinates), in the order of
  /// StoreWindow::points(). order: scratch memory.
  void add(const StoredBox& window, const GeographicBox& box, SurfaceSamples& out,
           std::vector<std::uint64_t>& order) const;

 private:
  /// Stored x, y and z at first.
  struct Sample {
    double longitude, latitude, height;
    std::uint32_t number;  ///< in the order of StoreWindow::points()
  };
  [[nodiscard]] std::size_t column_or_row(std::size_t axis, double stored) const;
  [[nodiscard]] std::size_t cell(double x, double y) const {
    return column_or_row(1, y) * cells_[0] + column_or_row(0, x);
  }
  void sort_into_cells(const stream::Store& store);
  void drop_duplicates();
  void place(const stream::Store& store, const StoredPlaces& places,
             const EllipsoidalHeights& vertical, unsigned threads);

  std::array<double, 2> from_{}, cells_per_unit_{};
  std::array<std::size_t, 2> cells_{1, 1};
  std::vector<Sample> samples_;       ///< by cells, row by row
  std::vector<std::uint32_t> begin_;  ///< in samples_, by cell; at last their number
};

}  // namespace terrace::terrain
