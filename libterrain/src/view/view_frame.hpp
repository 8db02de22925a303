// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>
#include <terrace/tri/multiresolution.hpp>

namespace terrace::terrain {

/// From stored coordinates to metres around the middle of the store.
class ViewFrame {
 public:
  /// ground: from a step in stored coordinates to metres.
  ViewFrame(const stream::Store& store, const stream::LinearMap& ground) : map_(ground) {
    const stream::Box3& bounds = store.bounds();
    if (bounds.empty()) return;
    // Heights count from 0 of the store's vertical unit, not from the sample 0.
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
  [[nodiscard]] tri::Box3 box_of(const tri::Box3& stored) const {
    stream::Box3 box;
    for (unsigned corner = 0; corner < 8; ++corner) {
      box.include((*this)({(corner & 1 ? stored.max : stored.min)[0],
                           (corner & 2 ? stored.max : stored.min)[1],
                           (corner & 4 ? stored.max : stored.min)[2]}));
    }
    return {box.min, box.max};
  }
  [[nodiscard]] const stream::LinearMap& ground() const { return map_; }

 private:
  stream::LinearMap map_;
  stream::Point3 middle_{};
};

}  // namespace terrace::terrain
