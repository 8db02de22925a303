// SPDX-License-Identifier: Apache-2.0
// A camera flies over a store. The mesh becomes finer where the camera looks and coarser where it
// has been, and each frame lists the triangles that were added and removed. Usage: flight INPUT
// STORE
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <set>
#include <thread>

#include <terrace/terrain/build.hpp>
#include <terrace/terrain/store_view.hpp>

using namespace terrace;

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: flight INPUT STORE\n"), 2;
  terrain::build_store({.inputs = {argv[1]}, .store = argv[2], .replace = true}, {.threads = 2});
  const stream::Store store = stream::Store::open(argv[2]);
  terrain::StoreView<std::int32_t> view(store);  // for rasters; for points use <double>

  std::set<tri::TriangleId> drawn;  // the triangles that a renderer keeps
  for (const auto t : view.model().triangulation().all_triangles()) drawn.insert(t);
  for (int frame = 0; frame < 2000 && (frame < 100 || !view.settled()); ++frame) {
    // Metres east, north and up from the middle of the store; the camera stops after 100 frames.
    const double east = -10'000.0 + 200.0 * std::min(frame, 100);
    const tri::Pose pose{{east, -20'000.0, 9000.0}, {0, 1, -0.5}, {0, 0, 1}};
    tri::View wish;
    wish.camera = tri::perspective_camera(pose, 60.0, 1.6, 1080.0);
    wish.pixel_error = 2.0;

    const auto& step = view.frame(wish, 0.010);
    for (const auto t : step.delta->changes.removed_triangles) drawn.erase(t);
    for (const auto t : step.delta->changes.added_triangles) drawn.insert(t);
    if (frame % 25 == 0) {
      std::printf("frame %3d: %zu triangles, %zu clusters expanded, %zu collapsed\n", frame,
                  drawn.size(), step.expanded, step.collapsed);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));  // the rest of a frame
  }
  std::printf("in the end %zu triangles of %llu points, read from %llu bytes\n", drawn.size(),
              1ULL * view.model().point_count(), 1ULL * view.traffic().bytes);
  return view.settled() && drawn.size() == view.model().triangulation().triangle_count() ? 0 : 1;
}
