// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>
#include <terrace/tri/multiresolution.hpp>

namespace terrace::terrain {

/// Converts stored coordinates to metres around the middle of the store.
class ViewFrame {
 public:
  /// ground: maps a difference in stored coordinates to metres.
  ViewFrame(const stream::Store& store, const stream::LinearMap& ground) : map_(ground) {
    const stream::Box3& bounds = store.bounds();
    if (bounds.empty()) return;
    // Heights start at 0 of the store's vertical unit, not at the sample 0.
    const stream::Channel& z = store.schema().coordinates[2];
    middle_ = {(bounds.min[0] + bounds.max[0]) / 2, (bounds.min[1] + bounds.max[1]) / 2,
               -z.offset / z.scale};
  }

  [[nodiscard]] stream::Point3 operator()(const stream::Point3& stored) const {
    const stream::Point3 v{stored[0] - middle_[0], stored[1] - middle_[1], stored[2] - middle_[2]};
    return {map_[0] * v[0] + map_[1] * v[1] + map_[2] * v[2],
            map_[3] * v[0] + map_[4] * v[1] + map_[5] * v[2],
            map_[6] * v[0] + map_[7] * v[1] + map_[8] * v[2]};
  }
  /// Converts back to stored coordinates, up to rounding. The map must not be singular.
  [[nodiscard]] stream::Point3 stored(const stream::Point3& p) const {
    const auto minor = [&](std::size_t a, std::size_t b, std::size_t c, std::size_t d) {
      return map_[a] * map_[d] - map_[b] * map_[c];
    };
    const stream::LinearMap adjugate{minor(4, 5, 7, 8), minor(2, 1, 8, 7), minor(1, 2, 4, 5),
                                     minor(5, 3, 8, 6), minor(0, 2, 6, 8), minor(2, 0, 5, 3),
                                     minor(3, 4, 6, 7), minor(1, 0, 7, 6), minor(0, 1, 3, 4)};
    const double determinant =
        map_[0] * adjugate[0] + map_[1] * adjugate[3] + map_[2] * adjugate[6];
    stream::Point3 result;
    for (std::size_t k = 0; k < 3; ++k) {
      const double* row = &adjugate[3 * k];
      result[k] = middle_[k] + (row[0] * p[0] + row[1] * p[1] + row[2] * p[2]) / determinant;
    }
    return result;
  }
  [[nodiscard]] tri::Box3 box_of(const tri::Box3& stored) const {
    stream::Box3 box;
    for (unsigned corner = 0; corner < 8; ++corner) {
      box.include((*this)({(corner & 1 ? stored.max : stored.min)[0],
                           (corner & 2 ? stored.max : stored.min)[1],
                           (corner & 4 ? stored.max : stored.min)[2]}));
    }
    return box;
  }
  [[nodiscard]] const stream::LinearMap& ground() const { return map_; }

 private:
  stream::LinearMap map_;
  stream::Point3 middle_{};
};

/// The frame of the views of a store. Throws: stream::Error for latitudes beyond a pole.
[[nodiscard]] ViewFrame view_frame(const stream::Store& store);

/// Integer coordinates in the view frame, for exact predicates in space. Cells are a power of two
/// metres, at most 2^29 of them along a side of the store's box.
class ViewLattice {
 public:
  ViewLattice(const stream::Store& store, const ViewFrame& frame) {
    if (store.bounds().empty()) return;
    const tri::Box3 box = frame.box_of({store.bounds().min, store.bounds().max});
    origin_ = box.min;
    double side = 0.0;
    for (std::size_t k = 0; k < 3; ++k) side = std::max(side, box.max[k] - box.min[k]);
    int exponent = 0;
    std::frexp(side, &exponent);
    cell_ = std::ldexp(1.0, std::max(exponent, -900) - 29);
  }
  /// Returns the nearest node, numbered from the low corner of the box.
  [[nodiscard]] stream::Point3 node(const stream::Point3& in_view_frame) const {
    stream::Point3 n;
    for (std::size_t k = 0; k < 3; ++k) {
      n[k] = std::floor((in_view_frame[k] - origin_[k]) / cell_ + 0.5);
    }
    return n;
  }
  [[nodiscard]] stream::Point3 in_view_frame(const stream::Point3& node) const {
    stream::Point3 p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = origin_[k] + cell_ * node[k];
    return p;
  }

 private:
  stream::Point3 origin_{};
  double cell_ = 1.0;
};

}  // namespace terrace::terrain
