// SPDX-License-Identifier: Apache-2.0
// Reads points, one per line with two or three coordinates, from standard input and prints their
// dendrogram, one row per merge as in SciPy's linkage matrix: cluster, cluster, height, size.
//     linkage METHOD [THREADS] < points
// METHOD is single, complete, average, weighted, ward, centroid or median, or complete-float, which
// uses a matrix of half the size. Without arguments it clusters two small rings and prints the
// number of clusters below a height for some methods.
#include "terrace/cluster/linkage.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace terrace::cluster;

std::vector<Point3> read_points(std::istream& in) {
  std::vector<Point3> points;
  for (std::string line; std::getline(in, line);) {
    std::istringstream fields(line);
    Point3 p{0.0, 0.0, 0.0};
    if (!(fields >> p[0])) continue;  // an empty line
    if (!(fields >> p[1])) throw std::runtime_error("a line has only one coordinate: " + line);
    fields >> p[2];
    points.push_back(p);
  }
  return points;
}

Dendrogram tree_of(const std::string& method, const std::vector<Point3>& points, unsigned threads) {
  if (method == "complete-float") {
    return complete_linkage(points, {.threads = threads, .entry = MatrixEntry::float32});
  }
  if (const auto known = linkage_method_named(method)) {
    return linkage(points, *known, {.threads = threads});
  }
  throw std::runtime_error("unknown method " + method);
}

int demonstrate() {
  std::vector<Point3> points;
  for (int i = 0; i < 60; ++i) {
    const double angle = 0.1047 * i;
    const double radius = i % 2 == 0 ? 1.0 : 2.0;
    points.push_back({radius * std::cos(angle), radius * std::sin(angle), 0.0});
  }
  // Single linkage follows the rings. The other methods make compact pieces.
  for (const char* method : {"single", "complete", "average"}) {
    const std::vector<std::uint32_t> labels = cut_height(tree_of(method, points, 1), 0.5);
    std::printf("%s linkage: %u clusters below 0.5\n", method,
                *std::max_element(labels.begin(), labels.end()) + 1);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return demonstrate();
  try {
    const unsigned threads = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1;
    for (const Merge& merge : tree_of(argv[1], read_points(std::cin), threads).merges) {
      std::printf("%u %u %.17g %u\n", merge.a, merge.b, merge.height, merge.size);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "linkage: %s\n", error.what());
    return 1;
  }
  return 0;
}
