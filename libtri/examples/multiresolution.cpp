// SPDX-License-Identifier: Apache-2.0
// A raster of 27 x 27 heights in two levels: the middle of every 3 x 3 cells represents its
// neighbours. The model is coarse, then fine in one corner, then coarse again.
#include "terrace/tri/multiresolution.hpp"

#include <cstdio>
#include <vector>

namespace tri = terrace::tri;

// Any store of clusters can be a source. This one computes them.
class Raster : public tri::ClusterSource {
 public:
  [[nodiscard]] unsigned top() const override { return 1; }
  [[nodiscard]] std::uint64_t cluster_count(unsigned) const override { return 81; }

  tri::ClusterRecord record(tri::ClusterId id) override {
    const double x = column(id), y = row(id);
    return {{{x - 1, y - 1, 0}, {x + 1, y + 1, 100}}, 1.5, 8};
  }

  tri::ClusterMembers read(tri::ClusterId id) override {
    positions_.clear();
    children_.clear();
    if (tri::level_of(id) == 1) {  // the root: the middles, each with the cluster that it heads
      for (std::uint64_t c = 0; c < 81; ++c) {
        const tri::ClusterId child = tri::cluster_id(0, c);
        positions_.push_back(cell(column(child), row(child)));
        children_.push_back(c);
      }
    } else {  // the eight cells around a middle
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          if (dx != 0 || dy != 0) positions_.push_back(cell(column(id) + dx, row(id) + dy));
        }
      }
    }
    return {positions_, children_};
  }

 private:
  static double column(tri::ClusterId id) {
    return static_cast<double>(3 * (tri::ordinal_of(id) % 9) + 1);
  }
  static double row(tri::ClusterId id) {
    return static_cast<double>(3 * (tri::ordinal_of(id) / 9) + 1);
  }
  static tri::Point3 cell(double x, double y) { return {x, y, x * y / 8}; }

  std::vector<tri::Point3> positions_;
  std::vector<std::uint64_t> children_;
};

int main() {
  Raster raster;
  tri::Multiresolution2<std::int32_t> model(raster);
  const std::uint64_t before = model.triangulation().hash();
  std::printf("coarse: %zu vertices, %zu triangles\n", model.triangulation().vertex_count(),
              model.triangulation().triangle_count());

  // Adds all of level 0 inside the box. The rest stays as it is.
  const auto& finer = model.refine(tri::box2(0, 0, 7, 7), 0);
  std::printf("a fine corner: %zu vertices and %zu triangles more, %zu triangles removed\n",
              finer.changes.added_vertices.size(), finer.changes.added_triangles.size(),
              finer.changes.removed_triangles.size());
  for (const tri::ClusterId id : model.expanded()) {
    std::printf("  %s is expanded\n", tri::to_string(id).c_str());
  }
  const tri::VertexId vertex = finer.changes.added_vertices.front();
  std::printf("  its first new vertex has level %u and height %g\n", model.level(vertex),
              model.height(vertex));

  // The triangulation must be the same as before.
  model.set_level(1);
  const bool same = model.triangulation().hash() == before;
  std::printf("coarse again: %s\n", same ? "the same triangles" : "NOT the same triangles");
  return same && model.point_count() == 81 ? 0 : 1;
}
