// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <terrace/stream/overlay.hpp>
#include <terrace/stream/point_writer.hpp>
#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/detail.hpp"

/// Points of mixed levels of detail, to a file.

namespace terrace::terrain {

/// Appends the points that `detail` wants, all attributes of the store with them, in the order of
/// for_each_wanted(). places: to the CRS of the file, unless it is the store's. overlay: its
/// heights replace the store's, which still decide what is inside a region; one thread then reads,
/// otherwise context.threads read and encode. Returns how many heights were replaced.
/// Memory: some 16,000 points and what `writer` encodes of them, twice per thread.
/// Throws: stream::Error on a damaged store, for a point without a place in that CRS, or if it
/// cannot be written; as for_each_wanted(); stream::Stopped.
std::uint64_t write_points(const stream::Store& store, const Detail& detail,
                           stream::PointWriter& writer, const PlaceConversion& places = {},
                           stream::Overlay* overlay = nullptr, const Context& context = {});

}  // namespace terrace::terrain
