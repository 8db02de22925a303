// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/triangle_mesh.hpp"

namespace terrace::terrain {

/// detail_mesh() of a store of triangles. Throws: stream::Error on a damaged store, or
/// when the triangles would not fit into memory_bytes, saying what they need.
[[nodiscard]] TriangleMesh detail_triangles(const stream::Store& store, const Detail& detail,
                                            std::uint64_t memory_bytes);

}  // namespace terrace::terrain
