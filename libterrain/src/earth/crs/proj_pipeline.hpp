// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>

#include "earth/crs/projection.hpp"

namespace terrace::terrain {

/// A coordinate operation that PROJ computes: x and y in, x and y out, in the units that its text
/// says. Copies share one pool of PROJ's objects, of which each thread takes its own while it
/// computes: const members may be called by several threads at once.
class ProjPipeline {
 public:
  /// definition: "+proj=pipeline ...". Throws: CrsError if PROJ cannot compute it.
  explicit ProjPipeline(const std::string& definition);

  [[nodiscard]] const std::string& definition() const;

  /// In place; NaN where there is no place. 0.6 (Krovak) to 4 million (LAEA) places per second.
  void forward(std::span<Point2> places) const;
  void reverse(std::span<Point2> places) const;
  /// Adds to each height what becomes of the height 0 at its place; NaN if nothing. Sizes are
  /// equal.
  void add_heights(std::span<const Point2> places, std::span<double> heights) const;

 private:
  class Pool;
  std::shared_ptr<Pool> pool_;
};

}  // namespace terrace::terrain
