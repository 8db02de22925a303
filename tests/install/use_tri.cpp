// SPDX-License-Identifier: GPL-3.0-or-later
// Four cocircular points in doubles need exact numbers to decide, so GMP must link.
#include <vector>

#include <terrace/tri/delaunay2.hpp>

int main() {
  terrace::tri::Delaunay2<double> triangulation;
  triangulation.build(std::vector<terrace::tri::Delaunay2<double>::Point>{
      {0.1, 0.1}, {0.3, 0.1}, {0.1, 0.3}, {0.3, 0.3}});
  return triangulation.triangle_count() == 2 ? 0 : 1;
}
