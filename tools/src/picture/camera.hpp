// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>

#include "terrace/stream/point.hpp"

namespace terrace::tools {

/// From where a picture is seen: the compass direction in which the viewer stands, and how high
/// above the horizon, both in degrees. From above, north is up.
struct ViewDirection {
  double azimuth = 180.0;
  double elevation = 90.0;
};

/// "top" or "AZIMUTH,ELEVATION" (elevation from -90 to 90). Throws: UsageError.
ViewDirection parse_view(const std::string& text);

/// A parallel projection: every direction right-handed and of unit length.
struct Camera {
  stream::Point3 right{1, 0, 0}, up{0, 1, 0}, toward{0, 0, 1};  ///< toward the viewer
  double scale = 1.0;                                           ///< pixels per metre
  double centre_x = 0.0, centre_y = 0.0;                        ///< along right and up, metres
  double width = 0.0, height = 0.0;                             ///< pixels

  explicit Camera(const ViewDirection& view);

  /// Pixels from the left and from the top, and the depth (metres toward the viewer).
  [[nodiscard]] std::array<double, 3> project(const stream::Point3& p) const;
};

}  // namespace terrace::tools
