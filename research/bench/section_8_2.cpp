// SPDX-License-Identifier: GPL-3.0-or-later
// Section 8.2: removal of vertices in space, one by one, by the thesis's queue of ears and by the
// library, which wraps the hole. The two must give the same triangulation.
#include <algorithm>
#include <ctime>
#include <random>
#include <stdexcept>
#include <vector>

#include <terrace/tri/delaunay3.hpp>

#include "setting.hpp"
#include "tri/ear_queue.hpp"

namespace terrace::research {
namespace {

using Triangulation = tri::Delaunay3<std::int32_t>;
using Point = std::array<std::int32_t, 3>;

std::vector<Point> cube(std::size_t count) {
  std::mt19937_64 random(1);
  std::vector<Point> points(count, Point{});
  for (Point& p : points) {
    for (std::int32_t& c : p) c = static_cast<std::int32_t>(random() >> 43);
  }
  return points;
}

/// All points of a grid, where every cube is cospherical, in random order.
std::vector<Point> grid(std::int32_t side) {
  std::vector<Point> points;
  for (std::int32_t x = 0; x < side; ++x) {
    for (std::int32_t y = 0; y < side; ++y) {
      for (std::int32_t z = 0; z < side; ++z) points.push_back({x, y, z});
    }
  }
  std::shuffle(points.begin(), points.end(), std::mt19937_64(1));
  return points;
}

/// Removes a tenth of the points and returns the CPU time, which is less affected by other load on
/// the machine than wall time.
template <class Remove>
double removal(Triangulation& triangulation, const std::vector<tri::VertexId>& vertices,
               const Remove& remove) {
  const std::clock_t start = std::clock();
  for (std::size_t i = 0; i < vertices.size(); i += 10) {
    if (triangulation.alive(vertices[i])) remove(vertices[i]);
  }
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

}  // namespace

void section_8_2(Setting& setting) {
  const int rounds = setting.is_small() ? 1 : 5;
  Table table{
      "section-8.2",
      "Section 8.2: a tenth of the vertices removed one by one, milliseconds of one thread, "
      "median of " +
          std::to_string(rounds) + ".",
      {"set", "points", "ears", "wrapping", "ears / wrapping"}};
  for (const bool regular : {false, true}) {
    const auto points =
        regular ? grid(setting.is_small() ? 12 : 60) : cube(setting.is_small() ? 2000 : 200'000);
    std::vector<double> ears, wrapping;
    for (int round = 0; round < rounds; ++round) {
      Triangulation one, other;
      const std::vector<tri::VertexId> vertices = one.build(points);
      if (other.build(points) != vertices) throw std::runtime_error("two builds differ");
      ears.push_back(removal(one, vertices, [&](tri::VertexId v) { remove_by_ears(one, v); }));
      wrapping.push_back(removal(other, vertices, [&](tri::VertexId v) { other.remove(v); }));
      if (one.hash() != other.hash()) {
        throw std::runtime_error("ears and wrapping give different triangulations");
      }
    }
    std::sort(ears.begin(), ears.end());
    std::sort(wrapping.begin(), wrapping.end());
    const double by_ears = ears[ears.size() / 2], by_wrapping = wrapping[wrapping.size() / 2];
    table.add({regular ? "grid" : "cube", grouped(points.size()), fixed(1e3 * by_ears, 1),
               fixed(1e3 * by_wrapping, 1), fixed(by_ears / by_wrapping, 2)});
  }
  setting.report.table(table);
}

}  // namespace terrace::research
