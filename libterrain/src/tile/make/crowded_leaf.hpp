// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>

#include <terrace/tri/point_tin.hpp>

#include "tile/format/address.hpp"
#include "tile/format/quantized_mesh.hpp"
#include "tile/make/sides.hpp"
#include "tile/make/surface.hpp"

namespace terrace::terrain {

/// Converts degrees of samples in a leaf to units of a tile. Clamps them to the leaf, because
/// rounding could move a sample on a side out of both leaves.
class LeafPlaces {
 public:
  LeafPlaces(const TileAddress& tile, const TileLeaf& leaf)
      : tile_box_(box_of(tile)),
        units_(kTileUnits / (tile_box_.east - tile_box_.west)),
        west_(leaf_unit(leaf.x, leaf.depth)),
        south_(leaf_unit(leaf.y, leaf.depth)),
        east_(leaf_unit(leaf.x + 1, leaf.depth)),
        north_(leaf_unit(leaf.y + 1, leaf.depth)) {}

  [[nodiscard]] double u(double longitude) const {
    return std::clamp((longitude - tile_box_.west) * units_, west_, east_);
  }
  [[nodiscard]] double v(double latitude) const {
    return std::clamp((latitude - tile_box_.south) * units_, south_, north_);
  }
  [[nodiscard]] double west() const { return west_; }
  [[nodiscard]] double south() const { return south_; }
  [[nodiscard]] double width() const { return east_ - west_; }
  [[nodiscard]] double height() const { return north_ - south_; }

 private:
  GeographicBox tile_box_;
  double units_, west_, south_, east_, north_;
};

/// Meshes a leaf that cannot be divided further and has too many samples to hold at once. Starts
/// with the lowest and the highest sample of each quarter of a unit. Then it measures all samples
/// part by part and adds those that exceed the bound, for a few rounds. The returned errors are
/// those of all samples. PointTin::sample and the vertex counts are meaningless. Memory: for a
/// part, and for 2^19 samples.
tri::PointTin mesh_crowded_leaf(const TileAddress& tile, const TileLeaf& leaf,
                                std::span<const tri::Point3> frame,
                                const tri::PointTinOptions& options, TileSurface& surface);

}  // namespace terrace::terrain
