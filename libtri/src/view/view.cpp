// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/view.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace terrace::tri {
namespace {

double dot(const Point3& a, const Point3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Point3 cross(const Point3& a, const Point3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Point3 combine(double s, const Point3& a, double t, const Point3& b) {
  return {s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2]};
}

void check_camera(bool good, const char* what) {
  if (!good) throw std::invalid_argument(std::string("camera: ") + what);
}

void check_positive(double value, const char* what) {
  check_camera(std::isfinite(value) && value > 0.0, what);
}

void check_finite(const Point3& p, const char* what) {
  check_camera(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]), what);
}

Point3 unit(const Point3& v, const char* what) {
  const double length = std::hypot(v[0], v[1], v[2]);
  check_positive(length, what);
  return {v[0] / length, v[1] / length, v[2] / length};
}

/// normal . (p - at) + extra >= 0
Plane plane(const Point3& normal, const Point3& at, double extra = 0.0) {
  return {normal, extra - dot(normal, at)};
}

Plane plane(const std::array<double, 4>& row) {
  const double length = std::hypot(row[0], row[1], row[2]);
  check_positive(length, "the matrix is degenerate");
  return {{row[0] / length, row[1] / length, row[2] / length}, row[3] / length};
}

struct Frame {
  Point3 forward, right, up;
};

Frame frame(const Pose& pose) {
  check_finite(pose.position, "the position is not finite");
  Frame f;
  f.forward = unit(pose.direction, "the direction is zero or not finite");
  f.right = cross(f.forward, unit(pose.up, "the up vector is zero or not finite"));
  check_camera(std::hypot(f.right[0], f.right[1], f.right[2]) > 1e-9,
               "the up vector is parallel to the direction; choose another");
  f.right = unit(f.right, "the up vector is parallel to the direction");
  f.up = cross(f.right, f.forward);
  return f;
}

/// The point where three planes meet.
Point3 meet(const std::array<double, 4>& a, const std::array<double, 4>& b,
            const std::array<double, 4>& c) {
  const Point3 u{a[0], a[1], a[2]}, v{b[0], b[1], b[2]}, w{c[0], c[1], c[2]};
  const Point3 vw = cross(v, w), wu = cross(w, u), uv = cross(u, v);
  const double det = dot(u, vw);
  check_camera(std::isfinite(det) && det != 0.0, "the matrix is degenerate");
  return {-(a[3] * vw[0] + b[3] * wu[0] + c[3] * uv[0]) / det,
          -(a[3] * vw[1] + b[3] * wu[1] + c[3] * uv[1]) / det,
          -(a[3] * vw[2] + b[3] * wu[2] + c[3] * uv[2]) / det};
}

}  // namespace

Camera perspective_camera(const Pose& pose, double fov_y_degrees, double aspect,
                          double viewport_height_pixels) {
  check_positive(fov_y_degrees, "the field of view must be more than 0 degrees");
  check_camera(fov_y_degrees < 180.0, "the field of view must be less than 180 degrees");
  check_positive(aspect, "the aspect must be positive and finite");
  check_positive(viewport_height_pixels, "the viewport's height must be positive and finite");
  const Frame f = frame(pose);
  const double tan_y = std::tan(fov_y_degrees * std::numbers::pi / 360.0), tan_x = tan_y * aspect;
  Camera camera;
  camera.position = pose.position;
  camera.direction = f.forward;
  const auto side = [&](double tangent, double sign, const Point3& axis) {
    return plane(unit(combine(tangent, f.forward, sign, axis), "the field of view is degenerate"),
                 pose.position);
  };
  camera.planes = {side(tan_x, 1.0, f.right), side(tan_x, -1.0, f.right), side(tan_y, 1.0, f.up),
                   side(tan_y, -1.0, f.up), plane(f.forward, pose.position)};
  camera.pixels = viewport_height_pixels / (2.0 * tan_y);
  return camera;
}

Camera orthographic_camera(const Pose& pose, double view_height, double aspect,
                           double viewport_height_pixels) {
  check_positive(view_height, "the view's height must be positive and finite");
  check_positive(aspect, "the aspect must be positive and finite");
  check_positive(viewport_height_pixels, "the viewport's height must be positive and finite");
  const Frame f = frame(pose);
  const double y = view_height / 2.0, x = y * aspect;
  Camera camera;
  camera.perspective = false;
  camera.position = pose.position;
  camera.direction = f.forward;
  camera.planes = {plane(f.right, pose.position, x),
                   plane(combine(-1.0, f.right, 0.0, f.up), pose.position, x),
                   plane(f.up, pose.position, y),
                   plane(combine(-1.0, f.up, 0.0, f.right), pose.position, y), Plane{}};
  camera.pixels = viewport_height_pixels / view_height;
  camera.height = view_height;
  return camera;
}

// The planes are those of G. Gribb and K. Hartmann, "Fast extraction of viewing frustum planes from
// the world-view-projection matrix" (2001), without the depth planes.
Camera matrix_camera(const std::array<double, 16>& view_projection, double viewport_height_pixels) {
  check_positive(viewport_height_pixels, "the viewport's height must be positive and finite");
  std::array<std::array<double, 4>, 4> rows{};
  for (std::size_t i = 0; i < 16; ++i) {
    check_camera(std::isfinite(view_projection[i]), "an entry of the matrix is not finite");
    rows[i / 4][i % 4] = view_projection[i];
  }
  const auto sum = [&](double sign, std::size_t row) {
    std::array<double, 4> result = rows[3];
    for (std::size_t k = 0; k < 4; ++k) result[k] += sign * rows[row][k];
    return result;
  };
  Camera camera;
  const Point3 w{rows[3][0], rows[3][1], rows[3][2]}, y{rows[1][0], rows[1][1], rows[1][2]};
  camera.perspective = dot(w, w) != 0.0;
  camera.planes = {plane(sum(1.0, 0)), plane(sum(-1.0, 0)), plane(sum(1.0, 1)), plane(sum(-1.0, 1)),
                   Plane{}};
  double scale;
  if (camera.perspective) {
    camera.planes[4] = plane(rows[3]);
    camera.position = meet(rows[0], rows[1], rows[3]);
    camera.direction = unit(w, "the matrix is degenerate");
    // An off-centre projection shears y along the axis.
    const Point3 perpendicular = combine(1.0, y, -dot(y, w) / dot(w, w), w);
    scale = std::sqrt(dot(perpendicular, perpendicular) / dot(w, w));
  } else {
    check_positive(rows[3][3], "the matrix is degenerate");
    camera.position = meet(rows[0], rows[1], rows[2]);
    camera.direction = unit({rows[2][0], rows[2][1], rows[2][2]}, "the matrix is degenerate");
    scale = std::sqrt(dot(y, y)) / rows[3][3];
  }
  check_finite(camera.position, "the matrix is degenerate");
  check_positive(scale, "the matrix is degenerate");
  camera.pixels = scale * viewport_height_pixels / 2.0;
  camera.height = 2.0 / scale;
  return camera;
}

Point3 RasterFrame::operator()(const Point3& p) const {
  Point3 result = origin;
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t j = 0; j < 3; ++j) result[k] += linear[3 * k + j] * p[j];
  return result;
}

Box3 RasterFrame::operator()(const Box3& box) const {
  Box3 result;
  for (std::size_t k = 0; k < 3; ++k) {
    result.min[k] = result.max[k] = origin[k];
    for (std::size_t j = 0; j < 3; ++j) {
      const double a = linear[3 * k + j] * box.min[j], b = linear[3 * k + j] * box.max[j];
      result.min[k] += std::min(a, b);
      result.max[k] += std::max(a, b);
    }
  }
  return result;
}

// At a given ground position the column and row depend on the height too, unless columns, rows and
// heights are mapped independently.
Box3 RasterFrame::cells(const Box3& ground) const {
  const auto& m = linear;
  const auto minor = [&](std::size_t a, std::size_t b, std::size_t c, std::size_t d) {
    return m[a] * m[d] - m[b] * m[c];
  };
  const double determinant =
      m[0] * minor(4, 5, 7, 8) - m[1] * minor(3, 5, 6, 8) + m[2] * minor(3, 4, 6, 7);
  const std::array<std::array<double, 3>, 2> inverse{
      {{minor(4, 5, 7, 8), minor(2, 1, 8, 7), minor(1, 2, 4, 5)},
       {minor(5, 3, 8, 6), minor(0, 2, 6, 8), minor(2, 0, 5, 3)}}};
  Box3 result = ground;
  for (std::size_t k = 0; k < 2; ++k) {
    result.min[k] = result.max[k] = 0.0;
    for (std::size_t j = 0; j < 3; ++j) {
      if (inverse[k][j] == 0.0) continue;
      const double a = inverse[k][j] / determinant * (ground.min[j] - origin[j]);
      const double b = inverse[k][j] / determinant * (ground.max[j] - origin[j]);
      result.min[k] += std::min(a, b);
      result.max[k] += std::max(a, b);
    }
  }
  return result;
}

NormalCone terrain_cone(const ClusterRecord& record) {
  const Box3& box = record.box;
  const double rise = box.max[2] - box.min[2];
  const double run = std::min(box.max[0] - box.min[0], box.max[1] - box.min[1]);
  NormalCone cone;
  cone.half_angle_degrees = 90.0;
  if (rise >= 0.0 && run > 0.0) {
    cone.half_angle_degrees = std::atan(rise / run) * 180.0 / std::numbers::pi;
  }
  return cone;
}

}  // namespace terrace::tri
