// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <terrace/stream/overlay.hpp>
#include <terrace/stream/store.hpp>

namespace terrace::terrain {

/// The overlay of `--overlay`: other heights of a store's points.
/// Throws: stream::Error, as Overlay::open and for one of other values than heights.
stream::Overlay open_height_overlay(const std::string& path, const stream::Store& store);

}  // namespace terrace::terrain
