// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/metric.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>

#include <terrace/base/portable_math.hpp>

#include "ground.hpp"

namespace terrace::cluster {
namespace {

template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;

void check_semi_axis(double length, std::size_t axis) {
  if (length > 0.0 && std::isfinite(length) && std::isfinite(1.0 / length)) return;
  throw std::invalid_argument("semi-axis " + std::to_string(axis) + " of an ellipse is " +
                              std::to_string(length) +
                              ": it must be positive and finite, in the unit of the points");
}

LinearMap rotation_about_z(double angle_degrees) {
  if (!std::isfinite(angle_degrees)) {
    throw std::invalid_argument(
        "the angle of an ellipse is not finite: give it in degrees, "
        "counter-clockwise from +x");
  }
  const auto [s, c] = base::sin_cos_degrees(angle_degrees);
  return {c, s, 0, -s, c, 0, 0, 0, 1};
}

double euclidean(const Point3& a, const Point3& b) {
  const double x = b[0] - a[0], y = b[1] - a[1], z = b[2] - a[2];
  return std::sqrt(x * x + y * y + z * z);
}

double mapped_length(const LinearMap& m, double x, double y, double z) {
  const double u = m[0] * x + m[1] * y + m[2] * z;
  const double v = m[3] * x + m[4] * y + m[5] * z;
  const double w = m[6] * x + m[7] * y + m[8] * z;
  return std::sqrt(u * u + v * v + w * w);
}

double minkowski(double p, double x, double y, double z) {
  x = std::abs(x);
  y = std::abs(y);
  z = std::abs(z);
  const double largest = std::max({x, y, z});
  if (largest == 0.0 || std::isinf(p)) return largest;
  if (p == 1.0) return x + y + z;
  // Relative to the largest component, so that powers neither overflow nor underflow.
  return largest * base::pow(base::pow(x / largest, p) + base::pow(y / largest, p) +
                                 base::pow(z / largest, p),
                             1.0 / p);
}

bool separate(const Box3& a, const Box3& b) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (a.max[axis] < b.min[axis] || b.max[axis] < a.min[axis]) return true;
  }
  return false;
}

}  // namespace

Elliptical::Elliptical(double a, double b, double angle_degrees, double c)
    : Elliptical({a, b, c}, rotation_about_z(angle_degrees)) {}

Elliptical::Elliptical(const Point3& semi_axes, const LinearMap& axes) : map_{}, least_scale_(0.0) {
  for (std::size_t k = 0; k < 3; ++k) check_semi_axis(semi_axes[k], k);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      double product = 0.0;
      for (std::size_t k = 0; k < 3; ++k) product += axes[3 * i + k] * axes[3 * j + k];
      if (!(std::abs(product - (i == j ? 1.0 : 0.0)) <= 1e-9)) {
        throw std::invalid_argument(
            "the axes of an ellipsoid are not orthonormal: product of rows " + std::to_string(i) +
            " and " + std::to_string(j) + " is " + std::to_string(product));
      }
    }
  }
  // M = sum over the axes of e e^T / semi-axis. Rotating back makes it symmetric.
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) {
        map_[3 * i + j] += axes[3 * k + i] * axes[3 * k + j] / semi_axes[k];
      }
    }
  }
  least_scale_ = 1.0 / std::max({semi_axes[0], semi_axes[1], semi_axes[2]});
}

Elliptical::Elliptical(const LinearMap& map) : map_(map), least_scale_(0.0) {
  const auto minor = [&map](std::size_t i, std::size_t j) {
    const std::size_t r1 = (i + 1) % 3, r2 = (i + 2) % 3, c1 = (j + 1) % 3, c2 = (j + 2) % 3;
    return map[3 * r1 + c1] * map[3 * r2 + c2] - map[3 * r1 + c2] * map[3 * r2 + c1];
  };
  const double plane = map[0] * map[4] - map[1] * map[3];
  const double determinant = map[0] * minor(0, 0) + map[1] * minor(0, 1) + map[2] * minor(0, 2);
  const bool is_symmetric = map[1] == map[3] && map[2] == map[6] && map[5] == map[7];
  const bool is_finite =
      std::all_of(map.begin(), map.end(), [](double m) { return std::isfinite(m); });
  if (!is_finite || !is_symmetric || !(map[0] > 0.0 && plane > 0.0 && determinant > 0.0)) {
    throw std::invalid_argument(
        "the matrix of an ellipsoid is not finite, symmetric and positive definite");
  }
  // The norm of the inverse is at most the root of the sum of its squares.
  double squares = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const double inverse = minor(i, j) / determinant;
      squares += inverse * inverse;
    }
  }
  least_scale_ = 1.0 / std::sqrt(squares);
}

EllipticalField::EllipticalField(std::vector<Region> regions, const std::optional<Frame>& frame)
    : regions_(std::move(regions)), frame_(frame) {
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (regions_[r].box.min[axis] <= regions_[r].box.max[axis]) continue;
      throw std::invalid_argument(
          "region " + std::to_string(r) + " of a field of metrics is empty or NaN along axis " +
          std::to_string(axis) + ": its minimum must not exceed its maximum");
    }
  }
}

Point3 EllipticalField::to_frame(const Point3& position) const {
  if (!frame_) return position;
  const LinearMap& m = frame_->map;
  Point3 result;
  for (std::size_t i = 0; i < 3; ++i) {
    result[i] = m[3 * i] * position[0] + m[3 * i + 1] * position[1] + m[3 * i + 2] * position[2] +
                frame_->offset[i];
  }
  return result;
}

const EllipticalField::Region* EllipticalField::find(const Point3& position) const {
  const Point3 point = to_frame(position);
  for (const Region& region : regions_) {
    if (region.box.contains(point)) return &region;
  }
  return nullptr;
}

const LinearMap& EllipticalField::operator()(const Point3& position) const {
  const Region* region = find(position);
  return region ? region->metric.map() : kIdentityMap;
}

double EllipticalField::least_scale(const Point3& position) const {
  const Region* region = find(position);
  return region ? region->metric.least_scale() : 1.0;
}

std::optional<LinearMap> EllipticalField::uniform_in(const Box3& box) const {
  // The bounding box of `box` in the frame.
  Box3 framed_box = box;
  if (frame_ && box.min[0] <= box.max[0]) {
    framed_box = Box3{};
    for (unsigned corner = 0; corner < 8; ++corner) {
      const Point3 point =
          to_frame({corner & 1u ? box.max[0] : box.min[0], corner & 2u ? box.max[1] : box.min[1],
                    corner & 4u ? box.max[2] : box.min[2]});
      for (std::size_t axis = 0; axis < 3; ++axis) {
        framed_box.min[axis] = std::min(framed_box.min[axis], point[axis]);
        framed_box.max[axis] = std::max(framed_box.max[axis], point[axis]);
      }
    }
  }
  for (const Region& region : regions_) {
    if (separate(region.box, framed_box)) continue;
    if (region.box.contains(framed_box.min) && region.box.contains(framed_box.max)) {
      return region.metric.map();
    }
    return std::nullopt;
  }
  return kIdentityMap;
}

bool is_symmetric(const Metric& metric) {
  if (const auto* custom = std::get_if<CustomMetric>(&metric)) return custom->symmetric;
  if (const auto* field = std::get_if<EllipticalField>(&metric)) return field->regions().empty();
  return true;
}

bool obeys_triangle_inequality(const Metric& metric) {
  return std::visit(Overloaded{
                        [](const Euclidean&) { return true; },
                        [](const SquaredEuclidean&) { return false; },
                        [](const Minkowski& m) { return m.p >= 1.0; },
                        [](const Elliptical&) { return true; },
                        [](const EllipticalField& field) { return field.regions().empty(); },
                        [](const CustomMetric& custom) { return custom.triangle_inequality; },
                    },
                    metric);
}

std::optional<LinearMap> linear_map(const Metric& metric, const Box3& box) {
  if (std::holds_alternative<Euclidean>(metric)) return kIdentityMap;
  if (const auto* elliptical = std::get_if<Elliptical>(&metric)) return elliptical->map();
  if (const auto* field = std::get_if<EllipticalField>(&metric)) return field->uniform_in(box);
  return std::nullopt;
}

std::optional<std::vector<Point3>> linear_points(const Metric& metric,
                                                 std::span<const Point3> points) {
  const std::optional<LinearMap> map = linear_map(metric, base::box_of(points));
  if (!map) return std::nullopt;
  std::vector<Point3> result(points.begin(), points.end());
  if (*map != kIdentityMap) {
    for (Point3& p : result) p = mapped(*map, p);
  }
  return result;
}

std::string name_of(const Metric& metric) {
  return std::visit(Overloaded{
                        [](const Euclidean&) -> std::string { return "euclidean"; },
                        [](const SquaredEuclidean&) -> std::string { return "squared"; },
                        [](const Minkowski& m) -> std::string {
                          std::string p = std::to_string(m.p);
                          if (p.find('.') != std::string::npos) {
                            p.erase(p.find_last_not_of('0') + 1);
                            if (p.back() == '.') p.pop_back();
                          }
                          return "minkowski:" + p;
                        },
                        [](const Elliptical&) -> std::string { return "elliptical"; },
                        [](const EllipticalField&) -> std::string { return "elliptical field"; },
                        [](const CustomMetric&) -> std::string { return "custom"; },
                    },
                    metric);
}

void check(const Metric& metric) {
  if (const auto* minkowski = std::get_if<Minkowski>(&metric); minkowski && !(minkowski->p > 0.0)) {
    throw std::invalid_argument("the exponent of a Minkowski distance is " +
                                std::to_string(minkowski->p) +
                                ": it must be positive (1 and above give a metric)");
  }
  if (const auto* custom = std::get_if<CustomMetric>(&metric); custom && !custom->distance) {
    throw std::invalid_argument("the custom metric has no distance function");
  }
}

double distance(const Metric& metric, const Point3& facility, const Point3& client) {
  const double x = client[0] - facility[0];
  const double y = client[1] - facility[1];
  const double z = client[2] - facility[2];
  return std::visit(
      Overloaded{
          [&](const Euclidean&) { return euclidean(facility, client); },
          [&](const SquaredEuclidean&) { return x * x + y * y + z * z; },
          [&](const Minkowski& m) { return minkowski(m.p, x, y, z); },
          [&](const Elliptical& e) { return mapped_length(e.map(), x, y, z); },
          [&](const EllipticalField& field) { return mapped_length(field(facility), x, y, z); },
          [&](const CustomMetric& custom) { return custom.distance(facility, client); },
      },
      metric);
}

double diagonal(const Metric& metric, const Box3& box) {
  if (!(box.min[0] <= box.max[0])) return 0.0;
  if (std::holds_alternative<EllipticalField>(metric)) return euclidean(box.min, box.max);
  double longest = 0.0;
  for (unsigned corner = 0; corner < 4; ++corner) {
    Point3 from = box.min, to = box.max;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      if (corner >> axis & 1u) std::swap(from[axis], to[axis]);
    }
    longest = std::max({longest, distance(metric, from, to), distance(metric, to, from)});
  }
  return longest;
}

}  // namespace terrace::cluster
