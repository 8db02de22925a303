// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/camera.hpp"

#include <cmath>
#include <vector>

#include <terrace/base/portable_math.hpp>

#include "base/units.hpp"
#include "base/vector.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;

ViewDirection parse_view(const std::string& text) {
  if (text == "top") return {};
  const std::vector<double> angles = parse_numbers(text, "the view '" + text + "'");
  if (angles.size() != 2 || std::abs(angles[1]) > 90) {
    throw UsageError("'" + text + "' is not a view; write top or AZIMUTH,ELEVATION in degrees");
  }
  return {.azimuth = angles[0], .elevation = angles[1]};
}

Camera::Camera(const ViewDirection& view) {
  const double sin_a = base::sin_degrees(view.azimuth);
  const double cos_a = base::cos_degrees(view.azimuth);
  const double sin_e = base::sin_degrees(view.elevation);
  const double cos_e = base::cos_degrees(view.elevation);
  toward = {sin_a * cos_e, cos_a * cos_e, sin_e};
  right = {-cos_a, sin_a, 0};
  up = {toward[1] * right[2] - toward[2] * right[1], toward[2] * right[0] - toward[0] * right[2],
        toward[0] * right[1] - toward[1] * right[0]};
}

std::array<double, 3> Camera::project(const stream::Point3& p) const {
  return {0.5 * width + (dot(p, right) - centre_x) * scale,
          0.5 * height - (dot(p, up) - centre_y) * scale, dot(p, toward)};
}

}  // namespace terrace::tools
