// SPDX-License-Identifier: Apache-2.0
// Applies steps, given clusters and pins in any order to a view control over a small hierarchy with
// points of a 10 x 10 raster and false records. Budgets must hold, the triangulation must stay
// valid and equal to a rebuild, and in the end a view that stays must settle.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

#include "../tests/multiresolution_hierarchy.hpp"
#include "delaunay2/access.hpp"
#include "terrace/tri/geomorph.hpp"
#include "terrace/tri/view.hpp"

namespace {

using namespace terrace::tri;
using Control = ViewControl2<std::int32_t>;

void require(bool good, const char* what) {
  if (good) return;
  std::fprintf(stderr, "%s\n", what);
  std::abort();
}

class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  [[nodiscard]] bool empty() const { return at_ >= size_; }
  std::uint8_t byte() { return at_ < size_ ? data_[at_++] : std::uint8_t{0}; }
  std::size_t below(std::size_t count) { return byte() % count; }
  /// -16 to 16 in eighths, or an extreme or invalid value.
  double number() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr double kOdd[] = {
        std::numeric_limits<double>::quiet_NaN(), kInfinity, -kInfinity, 1e308, -1e308, 1e-308};
    const std::uint8_t b = byte();
    return b >= 250 ? kOdd[b - 250] : (b - 125) / 8.0;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

test::MemorySource make_source(Input& input) {
  std::mt19937_64 random(input.byte());
  const std::size_t count = 1 + input.below(60);
  std::vector<Point3> points = test::make_points(test::Shape::duplicates, count, random);
  for (Point3& p : points) p[2] = static_cast<double>(test::below(random, 9));
  const unsigned levels = 1 + static_cast<unsigned>(input.below(3));
  test::MemorySource source = test::make_hierarchy(points, levels, 3.0, random);
  const bool lies = input.below(2) != 0;
  for (auto& level : source.levels) {
    for (auto& cluster : level) {
      cluster.record.error = static_cast<double>(input.below(16));
      if (!lies) continue;
      cluster.record.error = input.number();
      cluster.record.box.min[input.below(3)] = input.number();
      cluster.record.box.max[input.below(3)] = input.number();
      if (input.below(8) == 0) cluster.record.members += 1;
    }
  }
  return source;
}

View make_view(Input& input) {
  View view;
  const std::size_t kind = input.below(4);
  try {
    Pose pose;
    for (double& c : pose.position) c = input.number();
    for (double& c : pose.direction) c = input.number();
    if (kind == 1) view.camera = perspective_camera(pose, 60.0, 1.5, 100.0);
    if (kind == 2) view.camera = orthographic_camera(pose, std::abs(input.number()), 1.5, 100.0);
    if (kind == 3) {
      std::array<double, 16> matrix;
      for (double& m : matrix) m = input.number();
      view.camera = matrix_camera(matrix, 100.0);
    }
  } catch (const std::invalid_argument&) {
  }
  view.pixel_error = 1.0 + input.byte();
  if (input.below(4) == 0) view.ground_error = static_cast<double>(input.below(12));
  const auto box = [&] {
    return Box3{{input.number(), input.number(), input.number()},
                {input.number(), input.number(), input.number()}};
  };
  if (input.below(4) == 0) view.regions.push_back({box(), static_cast<double>(input.below(9))});
  if (input.below(4) == 0) view.focuses.push_back({box(), static_cast<unsigned>(input.below(4))});
  return view;
}

void check(const Control& control, const ViewOptions& options, std::size_t root) {
  const auto& triangulation = control.model().triangulation();
  require(find_fault(triangulation).empty(), "the triangulation is not valid");
  require(control.model().point_count() <= std::max(options.max_points, root), "too many points");
  require(control.cached_bytes() <= options.max_cached_bytes, "too many bytes");
  std::vector<std::array<std::int32_t, 2>> points;
  for (const VertexId v : triangulation.all_vertices()) points.push_back(triangulation.point(v));
  Delaunay2<std::int32_t> other;
  other.build(points);
  require(other.hash() == triangulation.hash(), "differs from a rebuild");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Input input(data, size);
  test::MemorySource source = make_source(input);
  std::vector<std::uint64_t> counts;
  for (unsigned level = 0; level < source.top(); ++level) {
    counts.push_back(source.cluster_count(level));
  }
  const std::size_t root = source.root().positions.size();
  ViewOptions options;
  options.max_points = root + input.byte();
  options.max_cached_bytes = 500 + 64 * std::size_t{input.byte()};
  options.silhouette = input.below(2) ? 1.0 : 0.3;
  options.collapse_below = (1.0 + static_cast<double>(input.below(8))) / 8.0;
  options.model.old_heights = true;
  Control control(counts, load_root(source), options);
  Geomorph2<std::int32_t> morph;
  View view;
  std::vector<ViewRequest> known;
  const auto step = [&](std::size_t operations) -> const Control::Step& {
    StepBudget budget;
    budget.operations = operations;
    const auto& done = control.step(view, budget);
    require(done.expanded + done.collapsed <= operations, "too many operations");
    morph.make(control.model(), *done.delta);
    known.insert(known.end(), done.wanted.begin(), done.wanted.end());
    check(control, options, root);
    return done;
  };
  for (int count = 0; count < 200 && !input.empty(); ++count) {
    const std::size_t kind = input.below(8);
    if (kind == 0) view = make_view(input);
    if (kind <= 3) step(1 + input.below(20));
    if (known.empty()) continue;
    const ViewRequest& request = known[input.below(known.size())];
    if (kind == 4 || kind == 5) control.give(load(source, request));
    if (kind == 6) control.forget(request.cluster);
    if (kind == 7) {
      const std::size_t action = input.below(3);
      if (action == 0) control.unpin(request.cluster);
      if (action == 1) control.pin(request.cluster, Control::Pin::expanded);
      if (action == 2) control.pin(request.cluster, Control::Pin::collapsed);
    }
  }
  for (int count = 0;; ++count) {
    require(count < 3000, "does not settle");
    const auto& done = step(1000);
    const std::vector<ViewRequest> wanted = done.wanted;
    if (done.settled && wanted.empty()) break;
    for (const ViewRequest& request : wanted) control.give(load(source, request));
  }
  return 0;
}
