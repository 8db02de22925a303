// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "facility/points/search_frame.hpp"
#include "facility/points/search_norms.hpp"
#include "terrace/cluster/metric.hpp"

/// Distances as the search engine uses them. There is one class per kind of metric, so that they
/// are inlined. Each class has
///     Row row(f)              distances from facility f: double operator()(client).
///                             order(client) sorts like the distance, and from_order() converts
///                             it to the distance.
///     box_distance(f, box)    lower bound of the computed distance from f to clients in the box
///                             (if kHasBoxes)
///     kHasBoxes               whether box_distance() exists, as strategies with trees require
///     has_triangles()         whether distances are symmetric and obey the triangle inequality

namespace terrace::cluster {

/// Factor that reduces computed lower bounds of distances, to allow for rounding.
inline constexpr double kBelieved = 1.0 - 1e-9;

/// Returns the components of the shortest vector from a point to a box.
inline Point3 to_box(const Point3& p, const Box3& box) {
  Point3 v{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (p[axis] < box.min[axis]) v[axis] = box.min[axis] - p[axis];
    if (p[axis] > box.max[axis]) v[axis] = p[axis] - box.max[axis];
  }
  return v;
}

template <class Norm, bool kChannels>
class NormSpace {
 public:
  static constexpr bool kHasBoxes = true;

  NormSpace(SearchFrame& frame, Norm norm, bool triangles)
      : points_(std::move(frame.points)),
        channels_(std::move(frame.channels)),
        channel_count_(frame.channel_count),
        norm_(norm),
        triangles_(triangles) {}

  struct Row {
    const NormSpace& space;
    Point3 origin;
    const double* channels;
    double operator()(std::uint32_t client) const {
      const Point3& p = space.points_[client];
      const double x = p[0] - origin[0], y = p[1] - origin[1], z = p[2] - origin[2];
      if constexpr (kChannels) {
        return space.norm_(x, y, z, space.channels_of(client), channels, space.channel_count_);
      } else {
        return space.norm_(x, y, z, nullptr, nullptr, 0);
      }
    }
    [[nodiscard]] double order(std::uint32_t client) const {
      if constexpr (kChannels || !std::is_same_v<Norm, EuclideanNorm>) {
        return (*this)(client);
      } else {
        const Point3& p = space.points_[client];
        return SquaredNorm{}(p[0] - origin[0], p[1] - origin[1], p[2] - origin[2], nullptr, nullptr,
                             0);
      }
    }
  };
  [[nodiscard]] static double from_order(double order) {
    return !kChannels && std::is_same_v<Norm, EuclideanNorm> ? std::sqrt(order) : order;
  }
  [[nodiscard]] Row row(std::uint32_t facility) const {
    return {*this, points_[facility], channels_of(facility)};
  }
  [[nodiscard]] double box_distance(std::uint32_t facility, const Box3& box) const {
    const Point3 v = to_box(points_[facility], box);
    return kBelieved * norm_(v[0], v[1], v[2], nullptr, nullptr, 0);
  }
  [[nodiscard]] bool has_triangles() const { return triangles_; }
  [[nodiscard]] std::span<const Point3> points() const { return points_; }

 private:
  [[nodiscard]] const double* channels_of(std::uint32_t i) const {
    return kChannels ? channels_.data() + i * channel_count_ : nullptr;
  }
  std::vector<Point3> points_;
  std::vector<double> channels_;
  std::size_t channel_count_;
  Norm norm_;
  bool triangles_;
};

/// An elliptical metric in each region, chosen by the region of the facility.
class FieldSpace {
 public:
  static constexpr bool kHasBoxes = true;

  /// original: the points in the coordinates of the regions.
  FieldSpace(SearchFrame& frame, std::span<const Point3> original, EllipticalField field)
      : points_(std::move(frame.points)),
        channels_(std::move(frame.channels)),
        channel_count_(frame.channel_count),
        field_(std::move(field)) {
    places_.reserve(original.size());
    for (const Point3& p : original) {
      Place place{&field_(p), field_.least_scale(p), 0.0};
      for (const double m : *place.map) place.slack = std::max(place.slack, std::abs(m) * 1e-13);
      places_.push_back(place);
    }
  }

  FieldSpace(FieldSpace&&) = default;  // not copyable, because places_ points into field_

  struct Row {
    const FieldSpace& space;
    Point3 origin;
    const LinearMap& map;
    const double* channels;
    double operator()(std::uint32_t client) const {
      const Point3& p = space.points_[client];
      const double x = p[0] - origin[0], y = p[1] - origin[1], z = p[2] - origin[2];
      const double d = EuclideanNorm{}(map[0] * x + map[1] * y + map[2] * z,
                                       map[3] * x + map[4] * y + map[5] * z,
                                       map[6] * x + map[7] * y + map[8] * z,
                                       space.channels_of(client), channels, space.channel_count_);
      return d < 0x1p500 ? d : 0x1p500;  // very flat ellipses may overflow a double
    }
    [[nodiscard]] double order(std::uint32_t client) const { return (*this)(client); }
  };
  [[nodiscard]] static double from_order(double order) { return order; }
  [[nodiscard]] Row row(std::uint32_t facility) const {
    return {*this, points_[facility], *places_[facility].map, channels_of(facility)};
  }
  [[nodiscard]] double box_distance(std::uint32_t facility, const Box3& box) const {
    const Point3 v = to_box(points_[facility], box);
    const Place& place = places_[facility];
    return kBelieved * place.least_scale * EuclideanNorm{}(v[0], v[1], v[2], nullptr, nullptr, 0) -
           place.slack;
  }
  [[nodiscard]] static bool has_triangles() { return false; }
  [[nodiscard]] std::span<const Point3> points() const { return points_; }

 private:
  struct Place {
    const LinearMap* map;
    double least_scale;
    double slack;  // rounding error of mapped vectors, whose components may cancel
  };
  [[nodiscard]] const double* channels_of(std::uint32_t i) const {
    return channels_.data() + i * channel_count_;
  }
  std::vector<Point3> points_;
  std::vector<double> channels_;
  std::size_t channel_count_;
  EllipticalField field_;
  std::vector<Place> places_;
};

/// The caller's distances, by index.
class IndexSpace {
 public:
  static constexpr bool kHasBoxes = false;
  using Function = std::function<double(std::uint32_t facility, std::uint32_t client)>;

  IndexSpace(Function distance, bool triangles)
      : distance_(std::move(distance)), triangles_(triangles) {}

  struct Row {
    const IndexSpace& space;
    std::uint32_t facility;
    double operator()(std::uint32_t client) const {
      const double d = space.distance_(facility, client);
      if (d >= 0.0 && d <= 0x1p1000) return d;
      throw std::invalid_argument("the distance from facility " + std::to_string(facility) +
                                  " to client " + std::to_string(client) + " is " +
                                  std::to_string(d) +
                                  ": the function must return numbers from 0 to 1e300");
    }
    [[nodiscard]] double order(std::uint32_t client) const { return (*this)(client); }
  };
  [[nodiscard]] static double from_order(double order) { return order; }
  [[nodiscard]] Row row(std::uint32_t facility) const { return {*this, facility}; }
  [[nodiscard]] bool has_triangles() const { return triangles_; }

 private:
  Function distance_;
  bool triangles_;
};

}  // namespace terrace::cluster
