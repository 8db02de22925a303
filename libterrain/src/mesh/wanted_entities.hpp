// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/detail.hpp"

namespace terrace::terrain {

/// Visits the entities of a store that `detail` wants, clusters in the order of for_each_wanted().
/// Passes the record of each entity and its corners in the CRS, bit for bit if the store's
/// coordinates are those of the CRS. An entity is located at its first corner. Throws:
/// stream::Error on a damaged store, and if there are more entities than fit in memory_bytes at
/// bytes_each.
void for_each_wanted_entity(
    const stream::Store& store, const Detail& detail, std::uint64_t memory_bytes,
    std::size_t bytes_each,
    const std::function<void(std::span<const std::byte> record,
                             std::span<const stream::Point3> corners)>& visit);

}  // namespace terrace::terrain
