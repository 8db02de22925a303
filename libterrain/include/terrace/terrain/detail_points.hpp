// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <terrace/stream/overlay.hpp>
#include <terrace/stream/point_writer.hpp>
#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/detail.hpp"

/// Writes points of mixed levels of detail to a file.

namespace terrace::terrain {

/// Appends the points that `detail` wants, with all attributes of the store, in the order of
/// for_each_wanted(). places: converts to the CRS of the file, unless that is the store's. overlay:
/// its heights replace the store's, but the store's heights decide whether a point is inside a
/// region. With an overlay one thread reads, otherwise context.threads read and encode. Returns the
/// number of replaced heights. Memory: about 16,000 points and their encoding by `writer`, twice
/// per thread. Throws: stream::Error on a damaged store, for a point without an image in that CRS,
/// or if writing fails; as for_each_wanted(); stream::Stopped.
std::uint64_t write_points(const stream::Store& store, const Detail& detail,
                           stream::PointWriter& writer, const PlaceConversion& places = {},
                           stream::Overlay* overlay = nullptr, const Context& context = {});

}  // namespace terrace::terrain
