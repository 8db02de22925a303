// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <terrace/stream/point_writer.hpp>
#include <terrace/stream/schema.hpp>

/// What a file of points says of its coordinates.

namespace terrace::terrain {

/// The CRS for stream::PointHeader of points of `own`, with WKT 1 (OGC 01-009), which LAS asks for,
/// or WKT 2 where that cannot say it. It names the unit of heights, unless that is the metre and
/// readers assume it. other: the CRS that x and y were converted to; heights stay as they are.
/// A CRS that is not known stays as it is.
stream::Crs crs_of_point_file(const stream::Placement& own,
                              const std::optional<stream::Crs>& other = std::nullopt);

/// Says that the file does not record the unit of heights, which readers take for another; empty if
/// it does, or if nothing is lost. path: of the file.
std::string lost_height_unit(const std::string& path, const stream::PointWriter& writer,
                             const stream::Placement& own,
                             const std::optional<stream::Crs>& other = std::nullopt);

}  // namespace terrace::terrain
