// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include <terrace/stream/point.hpp>

/// Triangles of a build's input, for the surface that is stored with its points.

namespace terrace::terrain {

/// Where the surface comes from that is stored with the points.
enum class SurfaceOrigin : std::uint8_t {
  automatic,  ///< the triangles of the input; restored from the points if the input has none
  input,      ///< the triangles of the input; an error if it has none
  restored    ///< the points alone
};

/// Reads the triangles of the input once.
struct InputTriangles {
  /// The corners in stored coordinates, oriented as in the input.
  using Triangle = std::array<stream::Point3, 3>;

  /// Replaces the vector with further triangles; returns false at the end. Throws: stream::Error
  /// for a damaged input, stream::Stopped. Empty if the surface must be restored from the points.
  std::function<bool(std::vector<Triangle>&)> next{};
  bool required = false;  ///< an input without triangles is an error
  /// True if the store has only selected points, so that triangles with other corners are left out.
  bool selected = false;
};

}  // namespace terrace::terrain
