// SPDX-License-Identifier: Apache-2.0
// A camera flies over a terrain that is never in memory as a whole. In each frame the control
// brings the model closer to the camera's view and names the missing clusters. A "loader" delivers
// them two frames later. In a viewer these would be threads or requests to a server.
#include <cmath>
#include <cstdio>
#include <deque>
#include <set>
#include <utility>
#include <vector>

#include <terrace/tri/geomorph.hpp>
#include <terrace/tri/view.hpp>

namespace tri = terrace::tri;

namespace {

// 729 x 729 heights in three levels. The middle of every 3 x 3 cells represents its neighbours, and
// the middle of every 9 x 9 represents the middles around it. Any store of clusters can be a
// source.
class Raster : public tri::ClusterSource {
 public:
  static constexpr std::uint64_t kSide = 729;

  [[nodiscard]] unsigned top() const override { return 2; }
  [[nodiscard]] std::uint64_t cluster_count(unsigned level) const override {
    return side(level) * side(level);
  }
  tri::ClusterRecord record(tri::ClusterId id) override {
    const auto [x, y] = middle(id);
    const double reach = tri::level_of(id) == 0 ? 1.0 : 4.0;
    // Heights are within 20, and the slope is less than 1.
    return {{{x - reach, y - reach, -20.0}, {x + reach, y + reach, 20.0}}, 2.0 * reach, 8};
  }
  tri::ClusterMembers read(tri::ClusterId id) override {
    const unsigned level = tri::level_of(id);
    positions_.clear();
    children_.clear();
    if (level == 2) {
      for (std::uint64_t i = 0; i < cluster_count(1); ++i) add(tri::cluster_id(1, i), 2);
    } else {
      const auto [x, y] = middle(id);
      const double step = level == 0 ? 1.0 : 3.0;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          if (dx == 0 && dy == 0) continue;
          const double u = x + dx * step, v = y + dy * step;
          positions_.push_back({u, v, height(u, v)});
          if (level == 1) children_.push_back(cell(0, u, v));
        }
      }
    }
    return {positions_, children_};
  }

 private:
  static std::uint64_t side(unsigned level) { return level == 0 ? kSide / 3 : kSide / 9; }
  static std::pair<double, double> middle(tri::ClusterId id) {
    const unsigned level = tri::level_of(id);
    const std::uint64_t row = side(level), size = kSide / row;
    const auto at = [&](std::uint64_t i) { return static_cast<double>(i * size + size / 2); };
    return {at(tri::ordinal_of(id) % row), at(tri::ordinal_of(id) / row)};
  }
  static std::uint64_t cell(unsigned level, double x, double y) {
    const std::uint64_t size = kSide / side(level);
    return static_cast<std::uint64_t>(y) / size * side(level) +
           static_cast<std::uint64_t>(x) / size;
  }
  // A member of the root, which is the head of a cluster on each level below.
  void add(tri::ClusterId id, unsigned levels) {
    const auto [x, y] = middle(id);
    positions_.push_back({x, y, height(x, y)});
    for (unsigned level = 0; level < levels; ++level) children_.push_back(cell(level, x, y));
  }
  static double height(double x, double y) {
    return 10.0 * std::sin(x / 40.0) + 8.0 * std::cos(y / 25.0);
  }

  std::vector<tri::Point3> positions_;
  std::vector<std::uint64_t> children_;
};

}  // namespace

int main() {
  Raster raster;
  tri::ViewOptions options;
  options.model.old_heights = true;  // for the geomorphs
  options.max_points = 120'000;
  tri::ViewControl2<std::int32_t> control({raster.cluster_count(0), raster.cluster_count(1)},
                                          tri::load_root(raster), options);
  const auto& terrain = control.model().triangulation();

  std::set<tri::TriangleId> drawn;  // the state of a renderer
  for (const tri::TriangleId t : terrain.all_triangles()) drawn.insert(t);
  tri::Geomorph2<std::int32_t> morph;
  std::deque<std::vector<tri::ViewRequest>> loading(2);
  std::size_t sliding = 0, at_target = 0;
  constexpr int kFrames = 120;
  for (int frame = 0; frame < kFrames; ++frame) {
    tri::View view;
    view.pixel_error = 8.0;
    // Flies to the middle of the terrain, looking ahead and down, and stops there.
    const double distance = 100.0 + 2.5 * std::min(frame, 100);
    view.camera = tri::perspective_camera({{distance, distance, 60.0}, {1, 1, -1.2}, {0, 0, 1}},
                                          60.0, 1.6, 800.0);
    tri::StepBudget budget;
    budget.operations = 300;  // or budget.seconds = 0.010; budget.clock = ...

    const auto& step = control.step(view, budget);
    for (const tri::TriangleId t : step.delta->changes.removed_triangles) drawn.erase(t);
    for (const tri::TriangleId t : step.delta->changes.added_triangles) drawn.insert(t);
    morph.make(control.model(), *step.delta);
    for (std::size_t i = 0; i < morph.added.size(); ++i) {
      sliding += morph.added.start[i][2] != morph.added.end[i][2];
    }
    if (step.worst <= 1.0) ++at_target;
    if (frame % 20 == 0 || frame == kFrames - 1) {
      std::printf("frame %3d: %6zu points; %3zu clusters expanded, %3zu collapsed, %3zu lacking\n",
                  frame, control.model().point_count(), step.expanded, step.collapsed,
                  step.missing + step.pending);
    }
    loading.push_back(step.requests);
    for (const tri::ViewRequest& request : loading.front()) {
      control.give(tri::load(raster, request));
    }
    loading.pop_front();
  }
  std::printf("%zu of %d frames at the wanted error; %zu vertices slid into place\n", at_target,
              kFrames, sliding);
  const bool same = drawn.size() == terrain.triangle_count();
  return same && sliding > 1000 && at_target > kFrames / 2 ? 0 : 1;
}
