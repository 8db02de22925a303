// SPDX-License-Identifier: Apache-2.0
// Compares the matching tree as a bounding volume hierarchy, with and without rotations
// (rotate_tree), with a kd-tree split at medians and a binned build by the surface area heuristic,
// over the same points and triangles. All trees go down to single primitives. Leaves of at most 8
// are then made by cost, with the same constants, layout and queries, so that only the tree
// differs. The inputs are points, synthetic meshes and, if TERRACE_DATA names the data folder,
// scans.
//
// Counters: the cost by the heuristic with both constants 1, primitives per leaf, and depth.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "ply.hpp"
#include "terrace/matching/matching_tree.hpp"
#include "terrace/matching/point_hierarchy.hpp"
#include "terrace/matching/triangle_hierarchy.hpp"
#include "tree_builders.hpp"

namespace {

using namespace terrace::matching;
using ply::Mesh;

bool small() { return std::getenv("TERRACE_BENCH_SMALL") != nullptr; }

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

/// Returns an approximately normal random number, the sum of twelve uniform ones.
double spread(std::mt19937_64& random) {
  double sum = -6.0;
  for (int k = 0; k < 12; ++k) sum += uniform(random);
  return sum;
}

std::vector<Point3> uniform_points(std::size_t n) {
  std::mt19937_64 random(1);
  std::vector<Point3> points(n);
  for (Point3& p : points) {
    for (double& c : p) c = uniform(random);
  }
  return points;
}

/// Makes clumps of different widths.
std::vector<Point3> clustered_points(std::size_t n) {
  std::mt19937_64 random(2);
  std::vector<Point3> middles = uniform_points(100), points(n);
  for (Point3& p : points) {
    const std::size_t clump = random() % middles.size();
    const double width = 0.001 * static_cast<double>(1 + clump % 30);
    for (std::size_t d = 0; d < 3; ++d) p[d] = middles[clump][d] + width * spread(random);
  }
  return points;
}

/// Makes a torus of 2 * side * side triangles with noise along its radius.
Mesh noisy_torus(std::uint32_t side) {
  std::mt19937_64 random(3);
  constexpr double kTurn = 6.283185307179586;
  Mesh mesh;
  for (std::uint32_t k = 0; k < side * side; ++k) {
    const double u = kTurn * (k / side) / side, v = kTurn * (k % side) / side;
    const double r = 0.4 * (1.0 + 0.3 * spread(random) / side), ring = 1.0 + r * std::cos(v);
    mesh.corners.push_back({ring * std::cos(u), ring * std::sin(u), r * std::sin(v)});
    const std::uint32_t next = k / side * side + (k + 1) % side;
    const auto over = [&](std::uint32_t corner) { return (corner + side) % (side * side); };
    mesh.triangles.push_back({k, over(k), next});
    mesh.triangles.push_back({next, over(k), over(next)});
  }
  return mesh;
}

// Large inputs are matched within the parts of a median split.
constexpr std::size_t kCluster = 10000;

std::vector<TreeChildren> matching_tree(const std::vector<Point3>& places) {
  std::vector<std::uint32_t> labels(places.size());
  std::uint32_t label = 0;
  std::vector<terrace::base::Box3> boxes;
  for (const Point3& p : places) boxes.push_back({p, p});
  std::vector<std::uint32_t> order(places.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  const std::function<void(std::span<std::uint32_t>)> mark = [&](std::span<std::uint32_t> range) {
    if (range.size() <= kCluster) {
      for (const std::uint32_t i : range) labels[i] = label;
      ++label;
      return;
    }
    const std::size_t middle = peers::halve(boxes, range);
    mark(range.first(middle));
    mark(range.subspan(middle));
  };
  mark(order);
  MatchingTreeOptions<Point3> options;
  options.labels = labels;
  return tree_children(make_matching_tree(std::span<const Point3>(places), options).rows);
}

constexpr std::array<const char*, 4> kBuilders{"matching", "rotated", "median", "binned"};

std::vector<TreeChildren> build(std::size_t builder, const std::vector<Point3>& places,
                                const std::vector<terrace::base::Box3>& boxes) {
  if (builder == 0) return matching_tree(places);
  if (builder == 1) return rotate_tree<3>(matching_tree(places), boxes);
  return builder == 2 ? peers::median_split(boxes) : peers::binned_sah(boxes);
}

/// The queries, which are the same for all trees.
struct Queries {
  std::vector<Point3> anywhere, near;
  std::vector<Ray> rays;
  double size = 0.0;  ///< the diagonal of the bounding box
};

/// Makes rays from an enclosing sphere to places in the box, and query points both anywhere in the
/// box and close to the data, off by one part in a thousand of its size.
Queries queries_for(const std::vector<Point3>& places) {
  std::mt19937_64 random(4);
  Point3 lo = places[0], hi = places[0];
  for (const Point3& p : places) {
    for (std::size_t d = 0; d < 3; ++d) {
      lo[d] = std::min(lo[d], p[d]);
      hi[d] = std::max(hi[d], p[d]);
    }
  }
  const double size = std::hypot(hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]);
  const auto in_box = [&] {
    Point3 p;
    for (std::size_t d = 0; d < 3; ++d) p[d] = lo[d] + (hi[d] - lo[d]) * uniform(random);
    return p;
  };
  Queries queries;
  queries.size = size;
  for (int k = 0; k < (small() ? 64 : 8192); ++k) {
    queries.anywhere.push_back(in_box());
    Point3 near = places[random() % places.size()], out;
    for (double& c : near) c += 0.001 * size * (uniform(random) - 0.5);
    queries.near.push_back(near);
    for (double& c : out) c = spread(random);
    const double length = std::hypot(out[0], out[1], out[2]);
    Ray ray;
    const Point3 aim = in_box();
    for (std::size_t d = 0; d < 3; ++d) {
      ray.origin[d] = 0.5 * (lo[d] + hi[d]) + size * out[d] / length;
      ray.direction[d] = aim[d] - ray.origin[d];
    }
    queries.rays.push_back(ray);
  }
  return queries;
}

/// A set of triangles, or of points if there are no triangles. Its trees are built on first use.
class Scene {
 public:
  Scene(std::string name, std::function<Mesh()> make)
      : name_(std::move(name)), make_(std::move(make)) {}

  const std::string& name() const { return name_; }
  bool triangles() { return load(), !mesh_.triangles.empty(); }
  const Queries& queries() { return load(), queries_; }
  const std::vector<Point3>& points() { return load(), mesh_.corners; }
  /// Returns the radius of the balls around points, less than half their spacing in a full cube.
  double radius() {
    load();
    return queries_.size / std::sqrt(3.0) * 0.3 / std::cbrt(static_cast<double>(points().size()));
  }

  std::vector<TreeChildren> rows(std::size_t builder) {
    load();
    return build(builder, places_, boxes_);
  }
  const PointHierarchy<3>& point_tree(std::size_t builder) {
    auto& made = point_trees_[builder];
    if (!made) made.emplace(rows(builder), points());
    return *made;
  }
  const TriangleHierarchy& triangle_tree(std::size_t builder) {
    auto& made = triangle_trees_[builder];
    if (!made) made.emplace(rows(builder), mesh_.corners, mesh_.triangles);
    return *made;
  }
  const BoundingVolumeHierarchy<3>& tree(std::size_t builder) {
    return triangles() ? triangle_tree(builder).tree() : point_tree(builder).tree();
  }

 private:
  void load() {
    if (!places_.empty()) return;
    mesh_ = make_();
    if (mesh_.triangles.empty()) {
      places_ = mesh_.corners;
      for (const Point3& p : places_) boxes_.push_back({p, p});
    } else {
      places_ = centroids(mesh_.corners, mesh_.triangles);
      for (const Triangle& triangle : mesh_.triangles) {
        peers::Bin around;
        for (const std::uint32_t corner : triangle) {
          around.add({mesh_.corners[corner], mesh_.corners[corner]});
          ++around.count;
        }
        boxes_.push_back(around.box);
      }
    }
    if (places_.empty()) throw std::runtime_error(name_ + " is empty");
    queries_ = queries_for(places_);
  }

  std::string name_;
  std::function<Mesh()> make_;
  Mesh mesh_;
  std::vector<Point3> places_;
  std::vector<terrace::base::Box3> boxes_;
  Queries queries_;
  std::array<std::optional<PointHierarchy<3>>, kBuilders.size()> point_trees_;
  std::array<std::optional<TriangleHierarchy>, kBuilders.size()> triangle_trees_;
};

void report(benchmark::State& state, const BoundingVolumeHierarchy<3>& tree) {
  std::size_t leaves = 0;
  for (const auto& node : tree.nodes()) leaves += node.count != 0;
  state.counters["sah"] = tree.surface_area_cost();
  state.counters["per_leaf"] =
      static_cast<double>(tree.order().size()) / static_cast<double>(leaves);
  state.counters["depth"] = static_cast<double>(tree.depth());
}

template <class Query>
void ask(benchmark::State& state, std::size_t queries, Query&& query) {
  std::size_t hits = 0, asked = 0;
  for (auto _ : state) {
    for (std::size_t k = 0; k < queries; ++k) hits += query(k) ? 1 : 0;
    asked += queries;
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(asked));
  state.counters["hit"] = static_cast<double>(hits) / static_cast<double>(asked);
}

using Run = std::function<void(benchmark::State&, Scene&, std::size_t builder)>;

void time_build(benchmark::State& state, Scene& scene, std::size_t builder) {
  scene.queries();
  for (auto _ : state) benchmark::DoNotOptimize(scene.rows(builder));
  report(state, scene.tree(builder));
}

void nearest(benchmark::State& state, Scene& scene, std::size_t builder,
             const std::vector<Point3>& places) {
  if (scene.triangles()) {
    const auto& tree = scene.triangle_tree(builder);
    ask(state, places.size(), [&](std::size_t k) { return tree.nearest(places[k]).has_value(); });
  } else {
    const auto& tree = scene.point_tree(builder);
    ask(state, places.size(), [&](std::size_t k) { return tree.nearest(places[k]).has_value(); });
  }
}

void nearest_eight(benchmark::State& state, Scene& scene, std::size_t builder) {
  const auto& tree = scene.point_tree(builder);
  const auto& places = scene.queries().near;
  std::vector<Neighbour> found;
  ask(state, places.size(), [&](std::size_t k) {
    tree.nearest(places[k], 8, found);
    return !found.empty();
  });
}

void first_along_rays(benchmark::State& state, Scene& scene, std::size_t builder) {
  const auto& rays = scene.queries().rays;
  if (scene.triangles()) {
    const auto& tree = scene.triangle_tree(builder);
    ask(state, rays.size(), [&](std::size_t k) { return tree.hit(rays[k]).has_value(); });
  } else {
    const auto& tree = scene.point_tree(builder);
    const double radius = scene.radius();
    ask(state, rays.size(), [&](std::size_t k) { return tree.hit(rays[k], radius).has_value(); });
  }
}

void add(const std::shared_ptr<Scene>& scene, bool points) {
  std::vector<std::pair<const char*, Run>> runs{
      {"build", time_build},
      {"nearest_anywhere",
       [](auto& state, Scene& s, std::size_t b) { nearest(state, s, b, s.queries().anywhere); }},
      {"nearest_close",
       [](auto& state, Scene& s, std::size_t b) { nearest(state, s, b, s.queries().near); }},
      {"ray", first_along_rays}};
  if (points) runs.insert(runs.begin() + 3, {"nearest_8", nearest_eight});
  for (const auto& [what, run] : runs) {
    for (std::size_t b = 0; b < kBuilders.size(); ++b) {
      const std::string name = scene->name() + "/" + what + "/" + kBuilders[b];
      auto* made = benchmark::RegisterBenchmark(
          name.c_str(), [scene, run = run, b](benchmark::State& state) { run(state, *scene, b); });
      made->Unit(benchmark::kMillisecond);
      if (std::string(what) == "build") made->Iterations(1);
    }
  }
}

// Some files are compressed. gzip reads plain files too.
std::string unpacked(const std::string& path) {
  std::FILE* pipe = popen(("gzip -dcf '" + path + "'").c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("cannot run gzip");
  std::string text;
  std::vector<char> block(1 << 16);
  std::size_t got = 0;
  while ((got = std::fread(block.data(), 1, block.size(), pipe)) != 0)
    text.append(block.data(), got);
  if (pclose(pipe) != 0) throw std::runtime_error("cannot read " + path);
  return text;
}

void add_scenes() {
  const std::size_t n = small() ? 500 : 200000;
  add(std::make_shared<Scene>("uniform", [n] { return Mesh{uniform_points(n), {}}; }), true);
  add(std::make_shared<Scene>("clustered", [n] { return Mesh{clustered_points(n), {}}; }), true);
  add(std::make_shared<Scene>("torus", [] { return noisy_torus(small() ? 15 : 220); }), false);
  const char* data = std::getenv("TERRACE_DATA");
  if (data == nullptr || small()) return;
  // Files without triangles are used as point sets.
  for (const auto& [name, points] : {std::pair{"bun_zipper.ply", false},
                                     {"horse.ply", false},
                                     {"lucy_100k.ply", false},
                                     {"dragon_vrip_res2.ply.gz", false},
                                     {"armadillo_tm.ply", true},
                                     {"igea.ply", true}}) {
    const std::string path = std::string(data) + "/scan/" + name;
    add(std::make_shared<Scene>(name, [path] { return ply::Reader(unpacked(path)).read(); }),
        points);
  }
}

}  // namespace

int main(int argc, char** argv) {
  add_scenes();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
