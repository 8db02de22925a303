// SPDX-License-Identifier: Apache-2.0
// Makes tiles for a web globe, stops halfway and resumes. Usage: tiles INPUT STORE FOLDER
#include <cstdio>
#include <stop_token>

#include <terrace/stream/error.hpp>
#include <terrace/terrain/build.hpp>
#include <terrace/terrain/tile_check.hpp>
#include <terrace/terrain/tiles.hpp>

using namespace terrace;

int main(int argc, char** argv) {
  if (argc != 4) return std::fprintf(stderr, "usage: tiles INPUT STORE FOLDER\n"), 2;
  terrain::build_store({.inputs = {argv[1]}, .store = argv[2], .replace = true}, {.threads = 2});
  const stream::Store store = stream::Store::open(argv[2]);
  terrain::TilesRequest request{.folder = argv[3]};
  request.vertical = terrain::HeightReference::orthometric;  // above sea level
  request.replace = true;

  // Any owner of the stop source may request a stop: another thread, or the progress handler
  // itself.
  std::stop_source stop;
  terrain::Context context{.threads = 2, .stop = stop.get_token()};
  context.progress = [&](const terrain::Progress& progress) {
    if (progress.count > 10) stop.request_stop();
  };
  try {
    terrain::write_tiles(store, request, context);
  } catch (const stream::Stopped&) {
    std::printf("stopped as requested\n");
  }

  // Finished tiles are kept.
  request.replace = false;
  request.resume = true;
  const terrain::TilesOutcome outcome = terrain::write_tiles(store, request, {.threads = 2});
  std::printf("%llu tiles, %llu of them new\n", 1ULL * outcome.tiles, 1ULL * outcome.made);
  const terrain::TileCheckResult check =
      terrain::check_tiles({.folder = argv[3], .store = &store, .vertical = request.vertical});
  std::printf("within %.2f m at zoom %u, %zu problems\n", check.zooms.back().max_error,
              check.zooms.back().zoom, check.problems.size());
  return stop.stop_requested() && check.problems.empty() ? 0 : 1;
}
