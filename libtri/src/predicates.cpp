// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/predicates.hpp"

#include "delaunay2/double_kernel.hpp"
#include "delaunay2/predicates.hpp"

namespace terrace::tri {

int orientation(const Point2& a, const Point2& b, const Point2& c) {
  return planar::DoubleKernel::orientation(a, b, c);
}

bool inside_circle(const Point2& a, const Point2& b, const Point2& c, const Point2& p) {
  return planar::inside_circle<planar::DoubleKernel>(a, b, c, p);
}

int compare_distance(const Point2& p, const Point2& a, const Point2& b) {
  return planar::DoubleKernel::compare_distance(p, a, b);
}

}  // namespace terrace::tri
