// SPDX-License-Identifier: Apache-2.0
// Finds four clumps of points in the plane by k-means.
#include <cstdio>
#include <random>

#include <terrace/cluster/k_means.hpp>

int main() {
  using namespace terrace::cluster;
  std::mt19937_64 random(1);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<Point3> points;
  for (int i = 0; i < 4000; ++i) {
    points.push_back({10.0 * (i % 2) + uniform(), 10.0 * (i / 2 % 2) + uniform(), 0.0});
  }

  KMeansOptions options;
  options.clusters = 4;
  options.restarts = 3;
  const KMeansResult result = k_means(points, /* weights */ {}, options);
  for (const Point3& c : result.centres) std::printf("%.2f %.2f\n", c[0], c[1]);
  std::printf("SSE %.1f after %zu iterations\n", result.sse, result.iterations);
  // The points are uniform in unit squares, so the expectation is 1/6 per point.
  return result.converged && result.sse < 4000 * 0.2 ? 0 : 1;
}
