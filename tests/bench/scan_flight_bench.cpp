// SPDX-License-Identifier: GPL-3.0-or-later
// A camera flies once around a body scanned in 20 million points, close to its surface, with an
// error small enough to keep about 200,000 of them in the model: 600 frames, each moving by 0.2 %
// of the visible width. A frame may take 10 ms, reading, tetrahedra and surface included (the files
// are in the page cache). Measured in one thread, and with a second thread that reads, where a
// frame is the first thread's time. At the end, computes the surface from scratch and reports the
// time and the changes.
//
// Uses the store that TERRACE_BENCH_SCAN names and creates it if it does not exist; without the
// variable, makes one for this run. Exits with 1 if a flight did not reach the target of its view
// or ended with different tetrahedra or, after the recomputation, a different surface than a new
// computation from its points.
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

/// A circle close above the body's equator, looking ahead and down by 30 degrees.
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
    // The visible area has about active() points of the body, whatever its size.
    const double area = std::numbers::pi * side * side;
    above_ =
        0.3 * std::sqrt(area * static_cast<double>(active()) / static_cast<double>(store.points()));
    radius_ = 0.5 * std::max(high[0] - low[0], high[1] - low[1]) + above_;
  }

  double scale = 1.0;  ///< a larger scale gives more points

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
  /// Visible width at the centre of the picture.
  [[nodiscard]] double width() const {
    return 2.0 * (2.0 * above_) * std::tan(kFov / 2 * std::numbers::pi / 180.0) * kAspect;
  }

 private:
  static constexpr double kAspect = 1.5, kFov = 60.0;
  terrace::stream::Point3 middle_{};
  double above_ = 0.0, radius_ = 0.0;
};

/// Recomputes the surface from scratch, prints the time and the changes, and compares the result
/// with a new object's. Returns the error, or an empty string.
std::string rest(View& viewer) {
  const Surface& surface = viewer.model().triangulation();
  const std::size_t triangles = surface.triangle_count();
  const double begin = now();
  const auto& changes = viewer.restore().changes;
  std::printf(
      "  at rest %zu vertices, %zu triangles; from scratch in %.0f ms: %zu triangles removed, %zu "
      "added\n",
      surface.vertex_count(), triangles, 1e3 * (now() - begin), changes.removed_triangles.size(),
      changes.added_triangles.size());
  std::vector<Surface::Point> points;
  for (const tri::VertexId v : surface.all_vertices()) points.push_back(surface.point(v));
  Surface fresh;
  fresh.build(points);
  if (fresh.tetrahedra().hash() != surface.tetrahedra().hash())
    return "the tetrahedra differ from a new computation";
  if (fresh.hash() != surface.hash()) return "the surface differs from a new computation";
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
