// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <memory>

#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>

#include "scene.hpp"

/// Scenes of scans whose surface was stored with the points.

namespace terrace::viewer {

/// Returns whether the scene of a scan is the surface that is stored with it: there is one, and
/// both its files and what is made of them are small enough for a browser. All files of the store
/// are needed at once.
[[nodiscard]] bool shows_stored_surface(const stream::Store& store);
/// Returns that scene (terrain::SurfaceView). Throws: as Scene::open().
[[nodiscard]] std::unique_ptr<Scene> open_stored_surface(const stream::Store& store,
                                                         const stream::LinearMap& ground,
                                                         std::size_t max_points);

}  // namespace terrace::viewer
