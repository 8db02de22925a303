// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "terrace/stream/source.hpp"

namespace terrace::stream {
struct Schema;
}

namespace terrace::terrain {

/// What places stored coordinates: the same few fields of a source and of a store.
struct Placement {
  stream::WorldTransform world;
  std::array<stream::Channel, 3> coordinates;
  stream::Crs crs;
};

Placement placement_of(const stream::SourceInfo& info);
Placement placement_of(const stream::Schema& schema);

/// Coordinates of the CRS for a point in stored coordinates.
stream::Point3 world_point(const Placement& placement, const stream::Point3& stored);

/// Stored x, y (column and row of a raster) of a place in the CRS: world_point() back.
std::array<double, 2> stored_place(const Placement& placement, const std::array<double, 2>& world);

/// The axis-aligned box in the CRS of a box in stored coordinates; empty stays empty. For rotated
/// rasters it is larger than the rotated box.
stream::Box3 world_box(const Placement& placement, const stream::Box3& stored);

}  // namespace terrace::terrain
