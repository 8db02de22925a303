// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <terrace/stream/point_writer.hpp>
#include <terrace/stream/schema.hpp>

/// The CRS and the units that a file of points records.

namespace terrace::terrain {

/// Returns the CRS that stream::PointHeader records for points with this placement. It has WKT 1
/// (OGC 01-009), which LAS requires, or WKT 2 if WKT 1 cannot express it. It names the unit of
/// heights, except for metres if readers assume them. other: the CRS to which x and y were
/// converted. Heights are not converted. vertical: stream::StoreSchema::vertical. "ellipsoidal" is
/// recorded even if the CRS does not say so. An unknown CRS is returned unchanged.
stream::Crs crs_of_point_file(const stream::Placement& placement,
                              const std::optional<stream::Crs>& other = std::nullopt,
                              const std::string& vertical = {});

/// Returns the units that stream::PointHeader records; empty ones if none are known. other: as in
/// crs_of_point_file().
stream::CoordinateUnits units_of_point_file(const stream::Placement& placement,
                                            const std::optional<stream::Crs>& other = std::nullopt);

/// Returns a note that the file does not record the unit of heights, so that readers assume another
/// one; empty if it records the unit or if nothing is lost. path: the path of the file.
std::string lost_height_unit(const std::string& path, const stream::PointWriter& writer,
                             const stream::Placement& placement,
                             const std::optional<stream::Crs>& other = std::nullopt);

}  // namespace terrace::terrain
