// SPDX-License-Identifier: Apache-2.0
// A camera flies around a scanned body. Its surface becomes finer where the camera approaches and
// coarser where it has been, and each frame lists the triangles that were added and removed. Once
// the camera rests, the surface is recomputed from scratch. Usage: scan_flight POINTS STORE
// (creates POINTS if missing)
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include <terrace/terrain/build.hpp>
#include <terrace/terrain/store_view.hpp>

using namespace terrace;

namespace {

/// Writes a body of about 100 m with ten lobes, along a spiral from pole to pole.
void scan(const char* file) {
  std::ofstream out(file);
  constexpr int kPoints = 40'000;
  for (int i = 0; i < kPoints; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kPoints, turn = 2.399963229728653 * i;
    const double radius = 50.0 + 5.0 * std::sin(5.0 * turn) * (1.0 - z * z);
    const double across = radius * std::sqrt(1.0 - z * z);
    out << across * std::cos(turn) << ' ' << across * std::sin(turn) << ' ' << radius * z << '\n';
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: scan_flight POINTS STORE\n"), 2;
  if (!std::filesystem::exists(argv[1])) scan(argv[1]);
  terrain::build_store({.inputs = {argv[1]}, .store = argv[2], .replace = true}, {.threads = 2});
  const stream::Store store = stream::Store::open(argv[2]);
  terrain::StoreView<tri::DynamicSurface<std::int32_t>> view(store);
  const auto& surface = view.model().triangulation();

  std::set<tri::TriangleId> drawn;  // the triangles that a renderer keeps
  for (const auto t : surface.all_triangles()) drawn.insert(t);
  const auto draw = [&](const auto& delta) {
    for (const auto t : delta.changes.removed_triangles) drawn.erase(t);
    for (const auto t : delta.changes.added_triangles) drawn.insert(t);
  };
  for (int frame = 0; frame < 2000 && (frame < 100 || !view.settled()); ++frame) {
    // Metres from the middle of the body; the camera stops after 100 frames.
    const double angle = 0.02 * std::min(frame, 100), c = std::cos(angle), s = std::sin(angle);
    const tri::Pose pose{{70.0 * c, 70.0 * s, 0.0}, {-c - 0.5 * s, 0.5 * c - s, 0.0}, {0, 0, 1}};
    tri::View wish;
    wish.camera = tri::perspective_camera(pose, 60.0, 1.6, 1080.0);
    wish.pixel_error = 10.0;

    const auto& step = view.frame(wish, 0.010);
    draw(*step.delta);
    if (frame % 25 == 0) {
      std::printf("frame %3d: %zu triangles, %zu clusters expanded, %zu collapsed\n", frame,
                  drawn.size(), step.expanded, step.collapsed);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));  // the rest of a frame
  }
  draw(view.restore(2));
  std::printf("in the end %zu triangles of %llu points, read from %llu bytes\n", drawn.size(),
              1ULL * view.model().point_count(), 1ULL * view.traffic().bytes);
  return view.settled() && drawn.size() == surface.triangle_count() ? 0 : 1;
}
