// SPDX-License-Identifier: GPL-3.0-or-later
// flight_hashes STORE MAX_POINTS [surface]: flies over a store. For each stop, prints the camera
// and the hash of the settled view as a line of JSON. The same flight in the browser's core must
// give the same hashes. surface: for a store taken for a scan, shows the surface that is stored
// with it or, without one, computed from scratch at each stop.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <string_view>

#include <terrace/stream/store.hpp>
#include <terrace/terrain/store_view.hpp>
#include <terrace/terrain/surface_view.hpp>

namespace {

using namespace terrace;

struct Shown {
  std::size_t points = 0, expanded = 0;
  bool open = false;
  std::uint64_t hash = 0;
};

template <class Kind>
Shown shown(terrain::StoreView<Kind>& view) {
  view.restore();
  const auto& mesh = view.model().triangulation();
  Shown result{view.points(), view.model().expanded_count(), false, mesh.hash()};
  if constexpr (requires { mesh.open(); }) result.open = mesh.open();
  return result;
}
Shown shown(terrain::SurfaceView& view) {
  return {view.surface().vertex_count(), 0, false, view.surface().hash()};
}

template <class View>
int fly(const stream::Store& store, View&& view) {
  stream::Box3 box;
  box.include(view.in_view_frame(store.bounds().min));
  box.include(view.in_view_frame(store.bounds().max));
  const double size =
      std::sqrt(std::pow(box.max[0] - box.min[0], 2) + std::pow(box.max[1] - box.min[1], 2));
  // Offset from the centre and height above the highest point as fractions of the size, direction
  // of view, pixels of error.
  struct Stop {
    double east, north, above;
    tri::Point3 direction;
    double error;
  };
  const Stop stops[] = {{0, -0.7, 0.5, {0, 1, -0.7}, 16},      {0, -0.2, 0.1, {0, 1, -0.6}, 8},
                        {0.1, 0, 0.03, {0.4, 1, -0.5}, 4},     {0.15, 0.1, 0.02, {1, 0.2, -0.4}, 2},
                        {0.2, 0.1, 0.02, {0.1, -1, -0.3}, 2},  {-0.1, -0.1, 0.05, {-1, 0.3, -1}, 3},
                        {0.05, 0.05, 0.01, {0.2, 0.1, -1}, 1}, {0, 0, 0.8, {0, 0.1, -1}, 12}};
  for (const Stop& stop : stops) {
    const tri::Point3 eye{(box.min[0] + box.max[0]) / 2 + stop.east * size,
                          (box.min[1] + box.max[1]) / 2 + stop.north * size,
                          box.max[2] + stop.above * size};
    const double length = std::hypot(stop.direction[0], stop.direction[1], stop.direction[2]);
    const tri::Point3 way{stop.direction[0] / length, stop.direction[1] / length,
                          stop.direction[2] / length};
    tri::View wish;
    wish.camera = tri::perspective_camera({eye, way, {0, 0, 1}}, 45, 1.5, 800);
    wish.pixel_error = stop.error;
    do {
      view.frame(wish, 0.05);
    } while (!view.settled());
    const Shown now = shown(view);
    std::printf(
        "{\"eye\":[%.17g,%.17g,%.17g],\"direction\":[%.17g,%.17g,%.17g],\"error\":%.17g,"
        "\"points\":%zu,\"expanded\":%zu,\"open\":%s,\"hash\":\"%016llx\"}\n",
        eye[0], eye[1], eye[2], way[0], way[1], way[2], stop.error, now.points, now.expanded,
        now.open ? "true" : "false", static_cast<unsigned long long>(now.hash));
  }
  return 0;
}

template <class Kind>
int fly_store(const stream::Store& store, const tri::ViewOptions& options) {
  using View = terrain::StoreView<Kind>;
  return fly(store, View(store, options, View::Reader::in_frame));
}

}  // namespace

int main(int arguments, char** values) {
  const bool surface = arguments == 4 && values[3] == std::string_view("surface");
  if (arguments != 3 && !surface) return 2;
  try {
    const stream::Store store = stream::Store::open(std::filesystem::path(values[1]));
    tri::ViewOptions options;
    options.max_points = std::strtoull(values[2], nullptr, 10);
    if (surface) {
      const auto ground = terrain::StoreView<tri::PointCloud>(store).ground();
      if (!terrain::is_scan(store, ground)) throw std::invalid_argument("the store is not a scan");
      if (terrain::SurfaceView::serves(store)) {
        return fly(store, terrain::SurfaceView(store, options));
      }
      return fly_store<tri::DynamicSurface<std::int32_t>>(store, options);
    }
    return store.schema().grid ? fly_store<tri::ThinnedDelaunay2>(store, options)
                               : fly_store<tri::PointCloud>(store, options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "flight_hashes: %s\n", error.what());
    return 1;
  }
}
