// SPDX-License-Identifier: GPL-3.0-or-later
// A camera flies close over a body that was scanned in 20 million points, once round, with as tight
// an error as keeps about 200,000 of them in the model: 600 frames, each moving by 0.2 % of the
// width of what is seen, 10 ms at most per frame, reading, tetrahedra and surface included (the
// files are in the page cache). In one thread, and with a second one that reads: then a frame is
// what the first one does. And what a computation of the surface from scratch takes and changes
// then.
//
// The store is the one that TERRACE_BENCH_SCAN names, made there if nothing is there; else one made
// for this run. Exit 1: a flight did not end at what its view asks for, or not with the tetrahedra
// and, from scratch, the surface of those points.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "cli/cli.hpp"
#include "flight_run.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/store_view.hpp"

namespace {

using terrace::stream::Store;
using namespace terrace::tests;
namespace tri = terrace::tri;
using Surface = tri::DynamicSurface<std::int32_t>;
using View = terrace::terrain::StoreView<Surface>;

std::size_t active() { return small() ? 10'000 : 200'000; }
constexpr double kBudget = 0.010, kShare = 0.002;

Store open_store(const std::filesystem::path& folder) {
  const char* given = std::getenv("TERRACE_BENCH_SCAN");
  terrace::terrain::BuildRequest request;
  request.store = given ? std::filesystem::path(given) : folder / "scan.store";
  if (std::filesystem::exists(request.store)) return Store::open(request.store);
  const std::string scan = (folder / "scan.ply").string();
  const std::array<const char*, 7> synth{
      "terrace", "synth",     "surface", "--points", small() ? "100000" : "20000000",
      "-o",      scan.c_str()};
  if (terrace::tools::run_command_line(static_cast<int>(synth.size()), synth.data()) != 0) {
    std::exit(1);
  }
  request.inputs = {scan};
  request.block_points = small() ? 1000 : 10000;
  terrace::terrain::build_store(request,
                                {.threads = std::max(1u, std::thread::hardware_concurrency())});
  return Store::open(request.store);
}

/// A circle close over the body's equator, looking ahead and down by 30 degrees.
class Orbit {
 public:
  explicit Orbit(const Store& store) {
    const terrace::terrain::StoreView<tri::PointCloud> view(store);
    const terrace::stream::Point3 low = view.in_view_frame(store.bounds().min);
    const terrace::stream::Point3 high = view.in_view_frame(store.bounds().max);
    double side = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      side += (high[k] - low[k]) / 3.0;
      middle_[k] = (high[k] + low[k]) / 2.0;
    }
    // As much is seen of small bodies as of large ones, in proportion.
    const double area = std::numbers::pi * side * side;
    above_ =
        0.3 * std::sqrt(area * static_cast<double>(active()) / static_cast<double>(store.points()));
    radius_ = 0.5 * std::max(high[0] - low[0], high[1] - low[1]) + above_;
  }

  double scale = 1.0;  ///< more of it, more points

  [[nodiscard]] tri::View view(double way) const {
    const double angle = way / radius_, c = std::cos(angle), s = std::sin(angle);
    tri::Pose pose;
    pose.position = {middle_[0] + radius_ * c, middle_[1] + radius_ * s, middle_[2]};
    const double ahead = std::sqrt(0.75), down = 0.5;
    pose.direction = {-s * ahead - c * down, c * ahead - s * down, 0.0};
    pose.up = {c, s, 0.0};
    tri::View view;
    view.camera = tri::perspective_camera(pose, kFov, kAspect, 1080.0);
    view.pixel_error = 2.0 / scale;
    return view;
  }
  /// Width of what is seen at the centre of the picture.
  [[nodiscard]] double width() const {
    return 2.0 * (2.0 * above_) * std::tan(kFov / 2 * std::numbers::pi / 180.0) * kAspect;
  }

 private:
  static constexpr double kAspect = 1.5, kFov = 60.0;
  terrace::stream::Point3 middle_{};
  double above_ = 0.0, radius_ = 0.0;
};

/// The surface from scratch: the time and the change, then against one of a new object.
std::string rest(View& viewer) {
  const Surface& surface = viewer.model().triangulation();
  const std::size_t triangles = surface.triangle_count();
  const double begin = now();
  const auto& changes = viewer.restore().changes;
  std::printf(
      "  at rest %zu vertices, %zu triangles; from scratch in %.0f ms: %zu triangles go, %zu "
      "come\n",
      surface.vertex_count(), triangles, 1e3 * (now() - begin), changes.removed_triangles.size(),
      changes.added_triangles.size());
  std::vector<Surface::Point> points;
  for (const tri::VertexId v : surface.all_vertices()) points.push_back(surface.point(v));
  Surface fresh;
  fresh.build(points);
  if (fresh.tetrahedra().hash() != surface.tetrahedra().hash())
    return "other tetrahedra than fresh";
  if (fresh.hash() != surface.hash()) return "another surface than fresh";
  return {};
}

int run() {
  const TemporaryFolder folder;
  const Store store = open_store(folder.path());
  warm(store);
  print_head(store, kBudget, kShare);
  Orbit orbit(store);
  tune<terrace::terrain::StoreView<tri::PointCloud>>(orbit, store, active());
  int status = 0;
  for (const View::Reader reader : {View::Reader::in_frame, View::Reader::thread}) {
    const char* name = reader == View::Reader::thread ? "scan, reader thread" : "scan, one thread";
    tri::ViewOptions options;
    options.model.reserve = 3 * active() / 2;
    View viewer(store, options, reader);
    std::string what = fly(name, orbit, viewer, reader, store, kBudget, kShare);
    if (what.empty()) what = rest(viewer);
    if (what.empty()) continue;
    std::fprintf(stderr, "%s: %s\n", name, what.c_str());
    status = 1;
  }
  return status;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "scan_flight_bench: %s\n", error.what());
    return 1;
  }
}
