// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <terrace/stream/point_writer.hpp>
#include <terrace/stream/store_query.hpp>

#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// A place in a store's CRS. Without a height it is a vertical line, and distances ignore heights.
struct NearPlace {
  std::array<double, 2> xy{};
  std::optional<double> z{};
};

/// Returns the `count` points of `level` and above that are nearest to the place on the ground, or
/// all if there are fewer. Sorted by distance, then by coordinates.
///
/// Distances are in metres, measured with the scale of the CRS at the place (degrees with the
/// ellipsoid's radii there). Within a kilometre and outside the polar regions their relative error
/// is about 1e-4. They do not cross the antimeridian.
///
/// query: a query of the store; reuse it, as queries at neighbouring places are fast. Throws:
/// UsageError for a level that the store does not have or numbers that are not finite;
/// stream::Error on a damaged store.
[[nodiscard]] std::vector<stream::FoundPoint> nearest_points(stream::StoreQuery& query,
                                                             const NearPlace& place,
                                                             std::size_t count, unsigned level = 0);

/// Returns the points of `level` and above within `radius` metres of the place, in the same order
/// and with the same distances. Throws: as above, and UsageError for a negative radius.
[[nodiscard]] std::vector<stream::FoundPoint> points_within(stream::StoreQuery& query,
                                                            const NearPlace& place, double radius,
                                                            unsigned level = 0);

/// Appends found points to a file, in their order, with all attributes of the store followed by
/// their distance as a double. places: converts to the CRS of the file, unless that is the store's.
/// Throws: stream::Error on a damaged store, for a point without an image in that CRS, or if
/// writing fails.
void write_found_points(const stream::StoreQuery& query, std::span<const stream::FoundPoint> found,
                        stream::PointWriter& writer, const PlaceConversion& places = {});

}  // namespace terrace::terrain
