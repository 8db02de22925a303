// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include <terrace/stream/store.hpp>

/// What requests need of a store, checked before any work.

namespace terrace::terrain {

/// Throws: stream::Error if the store holds anything but points; `what` needs them.
void need_points(const stream::Store& store, const std::string& what);
/// True for a CRS, as a store records it, whose x, y and z count from the middle of the earth.
bool is_geocentric(const stream::Crs& recorded);
/// need_points(), and that z is a height. Throws: stream::Error for a store in a geocentric CRS.
void need_terrain(const stream::Store& store, const std::string& what);
/// Throws: UsageError if the store has no such level.
void need_level(const stream::Store& store, unsigned level);
/// Throws: stream::Error if the clusters of a level and of those above do not have as many points
/// as the manifest tells; for who reads them without Store::for_each().
void need_all_points(const stream::Store& store, unsigned level, std::uint64_t points);
/// "x from 0 to 10, y from 0 to 5, z from -1 to 1": where the points are, those of a view that meet
/// its condition. Throws: stream::Error if none does.
std::string extent_text(const stream::Store& store);
/// Throws stream::Error that says where the points are: none of `what` is in a region, or no point
/// meets the condition of a view.
[[noreturn]] void throw_none_inside(const stream::Store& store, const std::string& what = "point");

}  // namespace terrace::terrain
