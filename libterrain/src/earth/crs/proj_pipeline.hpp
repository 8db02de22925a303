// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>

#include "earth/crs/projection.hpp"

namespace terrace::terrain {

/// A coordinate operation computed by PROJ: from x and y to x and y, in the units of its
/// definition. Copies share a pool of PROJ's objects, and each thread uses its own object, so
/// several threads may call const members at once.
class ProjPipeline {
 public:
  /// definition: "+proj=pipeline ...". Throws: CrsError if PROJ cannot compute it.
  explicit ProjPipeline(const std::string& definition);

  [[nodiscard]] const std::string& definition() const;

  /// Convert in place; NaN where a place has no image. 0.6 (Krovak) to 4 million (LAEA) places per
  /// second.
  void forward(std::span<Point2> places) const;
  void reverse(std::span<Point2> places) const;
  /// Adds the image of height 0 at each place to the height of the place. The height becomes NaN if
  /// the place has no image. Both spans must have the same size.
  void add_heights(std::span<const Point2> places, std::span<double> heights) const;

 private:
  class Pool;
  std::shared_ptr<Pool> pool_;
};

}  // namespace terrace::terrain
