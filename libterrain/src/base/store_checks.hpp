// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include <terrace/stream/store.hpp>

/// What requests need of a store, checked before any work.

namespace terrace::terrain {

/// Throws: stream::Error if the store holds anything but points; `what` needs them.
void need_points(const stream::Store& store, const std::string& what);
/// Throws: UsageError if the store has no such level.
void need_level(const stream::Store& store, unsigned level);
/// Throws: stream::Error if the clusters of a level and of those above do not have as many points
/// as the manifest tells; for who reads them without Store::for_each().
void need_all_points(const stream::Store& store, unsigned level, std::uint64_t points);
/// Throws stream::Error: a region and the store have nothing in common.
[[noreturn]] void throw_region_outside(const stream::Store& store);

}  // namespace terrace::terrain
