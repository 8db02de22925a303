// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include <terrace/stream/message.hpp>
#include <terrace/stream/store.hpp>

/// Requirements of requests on a store, checked before any work.

namespace terrace::terrain {

/// Throws: stream::Error unless the store holds points. what: the request that needs them.
void need_points(const stream::Store& store, const std::string& what);
/// Whether a recorded CRS is geocentric: x, y and z are measured from the centre of the earth.
bool is_geocentric(const stream::Crs& recorded);
/// As need_points(). Also throws stream::Error for a store in a geocentric CRS, whose z is not a
/// height.
void need_terrain(const stream::Store& store, const std::string& what);
/// Throws: UsageError if the store does not have this level.
void need_level(const stream::Store& store, unsigned level);
/// Throws: stream::Error if the clusters of a level and of those above do not have as many points
/// as the manifest says. Call it before reading them without Store::for_each().
void need_all_points(const stream::Store& store, unsigned level, std::uint64_t points);
/// Throws: stream::Error with this remedy if a surface of that many points does not fit in memory.
void need_memory_for_surface(const stream::Store& store, std::uint64_t points,
                             std::uint64_t bytes_per_point, std::uint64_t memory_bytes,
                             const stream::Message& remedy =
                                 stream::message("choose a coarser {level} or a smaller {region}"));
/// Returns the extent of the points as text: "x from 0 to 10, y from 0 to 5, z from -1 to 1". In a
/// view, only points that meet the condition count. Throws: stream::Error if no point does.
std::string extent_text(const stream::Store& store);
/// Throws a stream::Error that states the extent of the points, because no `what` is in a region,
/// or no point meets the condition of a view.
[[noreturn]] void throw_none_inside(const stream::Store& store, const std::string& what = "point");

}  // namespace terrace::terrain
