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

/// A place in a store's CRS. Without a height it is a vertical line: heights then do not count
/// in distances.
struct NearPlace {
  std::array<double, 2> xy{};
  std::optional<double> z{};
};

/// The `count` points of `level` and above that are nearest to the place on the ground, all if
/// there are fewer; the nearest first, of equally near ones those with smaller coordinates first.
///
/// Distances are in metres, measured by the scale that the CRS has at the place (degrees by the
/// ellipsoid's radii there): within a kilometre right to about 1e-4 of themselves outside the polar
/// regions. They do not reach across the antimeridian.
///
/// query: of the store; queries at near places are fast. Throws: UsageError for a level that the
/// store does not have or numbers that are not finite; stream::Error on a damaged store.
[[nodiscard]] std::vector<stream::FoundPoint> nearest_points(stream::StoreQuery& query,
                                                             const NearPlace& place,
                                                             std::size_t count, unsigned level = 0);

/// The points of `level` and above that are at most `radius` metres from the place, in the same
/// order and with the same distances. Throws as above, and UsageError for a negative radius.
[[nodiscard]] std::vector<stream::FoundPoint> points_within(stream::StoreQuery& query,
                                                            const NearPlace& place, double radius,
                                                            unsigned level = 0);

/// Appends such points to a file, in their order, with all attributes of the store and, behind
/// them, their distance as a double. places: to the CRS of the file, unless it is the store's.
/// Throws: stream::Error on a damaged store, for a point without a place in that CRS, or if it
/// cannot be written.
void write_found_points(const stream::StoreQuery& query, std::span<const stream::FoundPoint> found,
                        stream::PointWriter& writer, const PlaceConversion& places = {});

}  // namespace terrace::terrain
