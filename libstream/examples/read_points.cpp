// SPDX-License-Identifier: Apache-2.0
// Reads points from a file, or from several as one, and prints their number and bounds:
//   read_points [FILE...]
// Without arguments it writes a small file first, so that it always has something to show.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/stream/point_writer.hpp>
#include <terrace/stream/source.hpp>
#include <unistd.h>

namespace stream = terrace::stream;

namespace {

/// Writes a hill of 100 x 100 points as binary PLY. Returns the name of the file.
std::string write_hill() {
  std::string path = std::filesystem::temp_directory_path() / "terrace-hill-XXXXXX.ply";
  const int file = mkstemps(path.data(), 4);
  if (file >= 0) close(file);
  const auto writer = stream::open_point_writer(path, {}, {.replace = true});
  stream::PointBlock block;
  for (int y = -50; y < 50; ++y) {
    block.clear();
    for (int x = -50; x < 50; ++x) {
      const double height = 1000.0 / (10.0 + 0.1 * (x * x + y * y));
      block.positions.push_back({691000.0 + x, 5338000.0 + y, height});
    }
    writer->append(block);
  }
  writer->finish();
  return path;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    std::vector<std::string> files(argv + 1, argv + argc);
    if (files.empty()) files.push_back(write_hill());
    const auto source = stream::open_source(files);
    stream::Box3 bounds;
    std::uint64_t points = 0;
    stream::PointBlock block;
    while (source->next(block)) {
      stream::to_world(source->info(), block);
      for (const stream::Point3& point : block.positions) bounds.include(point);
      points += block.size();
    }
    std::printf("%s: %llu points\n", source->info().format.c_str(),
                static_cast<unsigned long long>(points));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::printf("%c: %.3f to %.3f\n", "xyz"[axis], bounds.min[axis], bounds.max[axis]);
    }
    if (argc == 1) std::filesystem::remove(files[0]);
  } catch (const stream::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
