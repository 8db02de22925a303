// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>

#include "terrace/stream/point.hpp"

namespace terrace::tools {

/// Where a picture is seen from: the compass direction of the viewer and the elevation above the
/// horizon, both in degrees. Seen from above, north is up.
struct ViewDirection {
  double azimuth = 180.0;
  double elevation = 90.0;
};

/// Parses "top" or "AZIMUTH,ELEVATION" (elevation from -90 to 90). Throws UsageError.
ViewDirection parse_view(const std::string& text);

/// A parallel projection. The directions have unit length and form a right-handed system.
struct Camera {
  stream::Point3 right{1, 0, 0}, up{0, 1, 0}, toward{0, 0, 1};  ///< toward the viewer
  double scale = 1.0;                                           ///< pixels per metre
  double centre_x = 0.0, centre_y = 0.0;                        ///< along right and up, metres
  double width = 0.0, height = 0.0;                             ///< pixels

  explicit Camera(const ViewDirection& view);

  /// Returns pixels from the left, pixels from the top, and the depth in metres toward the viewer.
  [[nodiscard]] std::array<double, 3> project(const stream::Point3& p) const;
};

}  // namespace terrace::tools
