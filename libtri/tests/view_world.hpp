// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "multiresolution_hierarchy.hpp"
#include "multiresolution_oracle.hpp"
#include "terrace/tri/view.hpp"

/// Hierarchies with true errors, and the demands of a view on them, as simple as possible.

namespace terrace::tri::test {

/// Sets the error of every cluster to the largest distance of a descendant from the head.
inline void fill_errors(MemorySource& source) {
  const auto walk = [&](auto&& self, ClusterId id, const Point3* head,
                        const std::vector<std::uint64_t>& head_children,
                        std::vector<Point3>& below) -> void {
    const unsigned level = level_of(id);
    MemorySource::Cluster& cluster = source.at(id);
    std::vector<Point3> own_positions = cluster.positions;
    for (std::size_t i = 0; level > 0 && i < cluster.positions.size(); ++i) {
      const auto* first = cluster.children.data() + i * level;
      const std::vector<std::uint64_t> ordinals(first, first + level);
      self(self, cluster_id(level - 1, ordinals.back()), &cluster.positions[i], ordinals,
           own_positions);
    }
    if (head && level > 0) {
      const std::vector<std::uint64_t> ordinals(head_children.begin(),
                                                head_children.begin() + level);
      self(self, cluster_id(level - 1, ordinals.back()), head, ordinals, own_positions);
    }
    if (head) {
      cluster.record.error = 0.0;
      for (const Point3& p : own_positions) {
        const double d = std::hypot(p[0] - (*head)[0], p[1] - (*head)[1], p[2] - (*head)[2]);
        cluster.record.error = std::max(cluster.record.error, d);
      }
    }
    below.insert(below.end(), own_positions.begin(), own_positions.end());
  };
  std::vector<Point3> all;
  walk(walk, cluster_id(source.top(), 0), nullptr, {}, all);
}

inline std::vector<std::uint64_t> counts(const MemorySource& source) {
  std::vector<std::uint64_t> result;
  for (unsigned level = 0; level < source.top(); ++level) {
    result.push_back(source.cluster_count(level));
  }
  return result;
}

struct Demands {
  double want, keep;
};

/// The demand by definition, regardless of the clusters above.
inline Demands own_demands(const View& view, const ViewOptions& options,
                           const ClusterRecord& record, unsigned level) {
  Demands result{0.0, 0.0};
  const Box3& box = record.box;
  if (view.camera) {
    const Camera& camera = *view.camera;
    double near = 0.0, far = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double e = camera.position[k], c = std::clamp(e, box.min[k], box.max[k]);
      near += (e - c) * (e - c);
      far = std::max({far, std::abs(e - box.min[k]), std::abs(e - box.max[k])});
    }
    near = std::sqrt(near);
    const double margin = options.guard * (camera.perspective ? far : camera.height);
    bool in = true, held = true;
    for (const Plane& plane : camera.planes) {
      double deepest = -1e300;
      for (unsigned corner = 0; corner < 8; ++corner) {
        double s = plane.offset;
        for (unsigned k = 0; k < 3; ++k) {
          s += plane.normal[k] * ((corner >> k & 1) ? box.max[k] : box.min[k]);
        }
        deepest = std::max(deepest, s);
      }
      in = in && deepest >= -margin * level / (level + 1.0);
      held = held && deepest >= -margin;
    }
    double pixels = record.error * camera.pixels;
    if (camera.perspective && record.error > 0.0) pixels /= near;
    if (in) result.want = pixels / view.pixel_error;
    if (held) result.keep = pixels / view.pixel_error;
  }
  const auto raise = [&](double want, double keep) {
    result.want = std::max(result.want, want);
    result.keep = std::max(result.keep, keep);
  };
  raise(record.error / view.ground_error, record.error / view.ground_error);
  const auto wider = [&](Box3 b) {
    double side = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (std::isfinite(b.max[k] - b.min[k])) side = std::max(side, b.max[k] - b.min[k]);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      b.min[k] -= options.guard * side;
      b.max[k] += options.guard * side;
    }
    return b;
  };
  for (const ErrorRegion& region : view.regions) {
    const double demand = record.error == 0.0 ? 0.0 : record.error / region.error;
    raise(region.box.intersects(box) ? demand : 0.0,
          wider(region.box).intersects(box) ? demand : 0.0);
  }
  for (const Focus& focus : view.focuses) {
    if (level < focus.level) continue;
    raise(focus.box.intersects(box) ? 1e300 : 0.0, wider(focus.box).intersects(box) ? 1e300 : 0.0);
  }
  return result;
}

/// The demand of each cluster, limited to the demand of the cluster above.
inline std::map<ClusterId, Demands> all_demands(const WholeTree& tree, MemorySource& source,
                                                const View& view, const ViewOptions& options) {
  std::map<ClusterId, Demands> result;
  // Ids ascend by level, so parents come first from the end.
  for (auto it = tree.parents.rbegin(); it != tree.parents.rend(); ++it) {
    Demands d = own_demands(view, options, source.at(it->first).record, level_of(it->first));
    const auto above = result.find(it->second);
    if (above != result.end()) {
      d.want = std::min(d.want, above->second.want);
      d.keep = std::min(d.keep, above->second.keep);
    }
    result[it->first] = d;
  }
  return result;
}

/// The state in which steps that start from `before` must end.
inline ClusterSet wanted_by(const WholeTree& tree, MemorySource& source, const View& view,
                            const ViewOptions& options, const ClusterSet& before) {
  ClusterSet result;
  for (const auto& [id, d] : all_demands(tree, source, view, options)) {
    if (d.want > 1.0 || (before.count(id) && d.keep >= options.collapse_below)) result.insert(id);
  }
  return result;
}

template <class T>
ClusterSet expanded_set(const ViewControl<T>& control) {
  const std::vector<ClusterId> ids = control.model().expanded();
  return {ids.begin(), ids.end()};
}

/// Takes steps, giving the clusters that they request, until a step changes nothing and lacks no
/// available cluster. Returns the number of steps.
template <class T>
int settle(ViewControl<T>& control, MemorySource& source, const View& view,
           const StepBudget& budget = {}) {
  for (int steps = 1;; ++steps) {
    const auto& step = control.step(view, budget);
    const std::vector<ViewRequest> wanted = step.wanted;
    if (step.settled && wanted.empty()) return steps;
    for (const ViewRequest& request : wanted) control.give(load(source, request));
    if (steps > 20000) {
      ADD_FAILURE() << "does not settle";
      return steps;
    }
  }
}

/// A hierarchy with true errors over one kind of points.
struct World {
  std::uint64_t seed;
  Shape shape;
  std::mt19937_64 random;
  MemorySource source;
  Box3 box;  // bounding box of all points

  World(std::uint64_t seed_, Shape shape_, std::size_t most = 300)
      : seed(seed_), shape(shape_), random(seed_) {
    const std::size_t count = 1 + below(random, most);
    const unsigned levels = 1 + static_cast<unsigned>(below(random, 4));
    const std::vector<Point3> points = make_points(shape, count, random);
    source = make_hierarchy(points, levels, 2.0 + 6.0 * unit(random), random);
    fill_errors(source);
    box = {points[0], points[0]};
    for (const Point3& p : points) {
      for (std::size_t k = 0; k < 3; ++k) {
        box.min[k] = std::min(box.min[k], p[k]);
        box.max[k] = std::max(box.max[k], p[k]);
      }
    }
  }
  [[nodiscard]] double extent() const {
    return std::max({box.max[0] - box.min[0], box.max[1] - box.min[1], 1.0});
  }
  Camera camera() {
    Pose pose;
    for (std::size_t k = 0; k < 2; ++k) {
      pose.position[k] = box.min[k] + (1.6 * unit(random) - 0.3) * (box.max[k] - box.min[k]);
    }
    pose.position[2] = box.max[2] + extent() * (0.02 + 0.8 * unit(random) * unit(random));
    pose.direction = {unit(random) - 0.5, unit(random) - 0.5, -0.1 - unit(random)};
    pose.up = {0.01 * unit(random), 1.0, 0.02};
    if (below(random, 4) == 0) {
      return orthographic_camera(pose, extent() * (0.05 + unit(random)), 1.5, 800.0);
    }
    return perspective_camera(pose, 20.0 + 60.0 * unit(random), 1.5, 800.0);
  }
  View view() {
    View result;
    if (below(random, 8) != 0) result.camera = camera();
    result.pixel_error = std::exp2(10.0 * unit(random) - 1.0);
    const auto place = [&] {
      Box3 b;
      for (std::size_t k = 0; k < 3; ++k) {
        const double u = unit(random), v = u + 0.5 * unit(random);
        b.min[k] = box.min[k] + u * (box.max[k] - box.min[k]);
        b.max[k] = box.min[k] + v * (box.max[k] - box.min[k]);
      }
      return below(random, 2) ? box2(b.min[0], b.min[1], b.max[0], b.max[1]) : b;
    };
    if (below(random, 4) == 0) result.ground_error = extent() * unit(random);
    if (below(random, 3) == 0) result.regions.push_back({place(), extent() * 0.3 * unit(random)});
    if (below(random, 4) == 0) {
      result.focuses.push_back({place(), static_cast<unsigned>(below(random, source.top() + 1))});
    }
    return result;
  }
};

inline constexpr Shape kWorldShapes[] = {Shape::random, Shape::grid, Shape::duplicates, Shape::line,
                                         Shape::one_place};

}  // namespace terrace::tri::test
