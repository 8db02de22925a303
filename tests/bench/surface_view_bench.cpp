// SPDX-License-Identifier: GPL-3.0-or-later
// Views of a surface that is stored with a scan. First a still camera, which sees the whole body,
// at several errors in pixels: vertices shown, and the distance between the surface shown and the
// full one, in pixels of the picture, at 99.9 % of the area in both directions (measured with
// CGAL). Then a flight close to the surface: 600 frames in at most 10 ms each, in one thread. Exits
// with 1 if the flight does not end with the surface of a new view.
//
//   surface_view_bench [STORE...]   stores made by `terrace build --surface`; without any, makes
//                                   one of a synthetic body
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "cli/cli.hpp"
#include "flight_run.hpp"
#include "terrace/terrain/surface_view.hpp"

namespace {

using namespace terrace::tests;
namespace tri = terrace::tri;
using terrace::stream::Store;
using terrace::terrain::SurfaceView;
using tri::Point3;

constexpr double kBudget = 0.010;

// ---- Distances --------------------------------------------------------------------------------

using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 point_of(const Point3& p) { return {p[0], p[1], p[2]}; }

Triangles triangles_of(const tri::SurfaceFront& front) {
  Triangles out;
  for (const tri::TriangleId t : front.all_triangles()) {
    const auto v = front.vertices(t);
    out.emplace_back(point_of(front.point(v[0])), point_of(front.point(v[1])),
                     point_of(front.point(v[2])));
  }
  return out;
}

/// Returns the distances of random points of a surface from another, in pixels, ascending.
std::vector<double> distances(const Triangles& from, const Tree& to, const tri::Camera& camera) {
  std::vector<double> area;
  double sum = 0.0;
  for (const auto& t : from) area.push_back(sum += std::sqrt(t.squared_area()));
  std::mt19937_64 random(1);
  const auto part = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<double> out;
  for (int i = 0; i < (small() ? 1000 : 20000); ++i) {
    const auto at = std::lower_bound(area.begin(), area.end(), part() * sum);
    const auto& t = from[std::min(static_cast<std::size_t>(at - area.begin()), from.size() - 1)];
    double u = part(), v = part();
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    const Kernel::Point_3 p = t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
    const double metres = std::sqrt(to.squared_distance(p));
    const Point3& eye = camera.position;
    out.push_back(metres * camera.pixels /
                  std::hypot(p.x() - eye[0], p.y() - eye[1], p.z() - eye[2]));
  }
  std::sort(out.begin(), out.end());
  return out;
}

// ---- Cameras ----------------------------------------------------------------------------------

struct Body {
  explicit Body(const SurfaceView& view) {
    tri::Box3 box;
    for (std::uint32_t v = 0; v < view.surface().size(); ++v) {
      box.include(view.surface().point(tri::VertexId{v}));
    }
    for (std::size_t k = 0; k < 3; ++k) {
      middle[k] = (box.min[k] + box.max[k]) / 2;
      diagonal = std::hypot(diagonal, box.max[k] - box.min[k]);
    }
    radius = 0.5 * std::max(box.max[0] - box.min[0], box.max[1] - box.min[1]);
  }
  Point3 middle{};
  double diagonal = 0.0, radius = 0.0;

  [[nodiscard]] tri::View whole(double pixel_error) const {
    const Point3 back{0.8 * diagonal, 0.6 * diagonal, 0.4 * diagonal};
    tri::View view;
    view.camera = tri::perspective_camera(
        {.position = {middle[0] + back[0], middle[1] + back[1], middle[2] + back[2]},
         .direction = {-back[0], -back[1], -back[2]},
         .up = {0, 0, 1}},
        60.0, 1.5, 1080.0);
    view.pixel_error = pixel_error;
    return view;
  }
  /// A circle close above the equator, looking ahead and down; way: from 0 to 1 around it.
  [[nodiscard]] tri::View orbit(double way) const {
    const double angle = 2.0 * std::numbers::pi * way, c = std::cos(angle), s = std::sin(angle);
    const double r = 1.3 * radius;
    tri::View view;
    view.camera =
        tri::perspective_camera({.position = {middle[0] + r * c, middle[1] + r * s, middle[2]},
                                 .direction = {-s * 0.7 - c * 0.7, c * 0.7 - s * 0.7, 0.0},
                                 .up = {c, s, 0.0}},
                                60.0, 1.5, 1080.0);
    view.pixel_error = 2.0;
    return view;
  }
};

void settle(SurfaceView& view, const tri::View& wish) {
  do {
    view.frame(wish, 10.0);
  } while (!view.settled());
}

void still(SurfaceView& view, const Body& body) {
  tri::View everything;
  everything.ground_error = 0.0;
  settle(view, everything);
  const Triangles full = triangles_of(view.surface());
  Tree full_tree(full.begin(), full.end());
  full_tree.accelerate_distance_queries();
  std::printf("%9s %9s %9s %15s %15s\n", "pixels", "vertices", "triangles", "shown, 99.9 %",
              "full, 99.9 %");
  for (const double pixels : {2.0, 4.0, 8.0, 16.0, 32.0}) {
    const tri::View wish = body.whole(pixels);
    settle(view, {});
    settle(view, wish);
    const Triangles shown = triangles_of(view.surface());
    Tree shown_tree(shown.begin(), shown.end());
    shown_tree.accelerate_distance_queries();
    std::printf("%9.0f %9zu %9zu %15.2f %15.2f\n", pixels, view.surface().vertex_count(),
                view.surface().triangle_count(),
                quantile(distances(shown, full_tree, *wish.camera), 0.999),
                quantile(distances(full, shown_tree, *wish.camera), 0.999));
  }
}

/// Returns whether the flight ends as a new view does.
bool fly(SurfaceView& view, const Store& store, const Body& body) {
  settle(view, body.orbit(0.0));
  std::vector<double> times;
  double vertices = 0.0, changed = 0.0;
  int at_target = 0;
  const int count = frames();
  for (int i = 1; i <= count; ++i) {
    const double begin = now();
    const SurfaceView::Step& step = view.frame(body.orbit(0.25 * i / count), kBudget);
    times.push_back(now() - begin);
    at_target += step.worst <= 1.0;
    vertices += static_cast<double>(view.surface().vertex_count());
    changed += static_cast<double>(step.activated + step.deactivated);
  }
  std::sort(times.begin(), times.end());
  std::printf(
      "flight: p50 %.2f ms, p99 %.2f ms, max %.2f ms, at target %.1f %%, %.0f vertices, "
      "%.0f changed per frame\n",
      1e3 * quantile(times, 0.5), 1e3 * quantile(times, 0.99), 1e3 * times.back(),
      100.0 * at_target / count, vertices / count, changed / count);
  // Hysteresis depends on the way, so both come from the same state.
  settle(view, {});
  settle(view, body.orbit(0.25));
  SurfaceView other(store);
  settle(other, body.orbit(0.25));
  return view.surface().hash() == other.surface().hash();
}

int run(const std::vector<std::string>& stores) {
  int status = 0;
  for (const std::string& name : stores) {
    const Store store = Store::open(name);
    const double begin = now();
    SurfaceView view(store);
    std::printf("%s: %zu vertices, opened in %.2f s, %.0f + %.0f bytes per vertex\n", name.c_str(),
                view.surface().size(), now() - begin,
                static_cast<double>(view.surface().memory_bytes()) /
                    static_cast<double>(view.surface().size()),
                static_cast<double>(view.control().memory_bytes()) /
                    static_cast<double>(view.surface().size()));
    const Body body(view);
    still(view, body);
    if (!fly(view, store, body)) {
      std::fprintf(stderr, "the flight ends with another surface than a new view\n");
      status = 1;
    }
  }
  return status;
}

/// Makes a store of a synthetic body.
std::string made_store(const std::filesystem::path& folder) {
  const std::string scan = (folder / "scan.ply").string(), store = (folder / "scan.store").string();
  const std::array<const char*, 7> synth{
      "terrace", "synth", "surface", "--points", small() ? "5000" : "200000", "-o", scan.c_str()};
  const std::array<const char*, 6> build{"terrace",   "build", scan.c_str(),
                                         "--surface", "-o",    store.c_str()};
  if (terrace::tools::run_command_line(static_cast<int>(synth.size()), synth.data()) != 0 ||
      terrace::tools::run_command_line(static_cast<int>(build.size()), build.data()) != 0) {
    std::exit(1);
  }
  return store;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const TemporaryFolder folder;
    std::vector<std::string> stores(argv + 1, argv + argc);
    if (stores.empty()) stores.push_back(made_store(folder.path()));
    return run(stores);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "surface_view_bench: %s\n", error.what());
    return 1;
  }
}
