// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace terrace::tri {

/// How hard to look for fewer triangles of an error-bounded surface.
enum class TinQuality : std::uint8_t {
  kGreedy,   ///< insertion alone: a Delaunay triangulation of its vertices (but for settled sides)
  kRemoval,  ///< then one pass of removals that keep the error: about 0.6 of the triangles
  kFitted,   ///< then heights moved within the error, which opens room for a second pass
};

}  // namespace terrace::tri
