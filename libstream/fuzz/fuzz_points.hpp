// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <span>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

#include "terrace/stream/error.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// Stops the fuzzer if the library broke a guarantee, also in release builds.
inline void require(bool good, const char* what) {
  if (good) return;
  std::fprintf(stderr, "broken guarantee: %s\n", what);
  std::abort();
}

/// Stops the fuzzer if the work is out of proportion to the bytes of the input and the items they
/// hold: more than two seconds of processor time plus ten microseconds for each, a hundred times
/// what parsers take.
class WorkLimit {
 public:
  explicit WorkLimit(std::uint64_t bytes) : items_(bytes) {}
  ~WorkLimit() {
    const double seconds = static_cast<double>(std::clock() - begin_) / CLOCKS_PER_SEC;
    require(seconds <= 2 + 1e-5 * static_cast<double>(items_), "time is proportional to the input");
  }
  WorkLimit(const WorkLimit&) = delete;
  WorkLimit& operator=(const WorkLimit&) = delete;

  /// Adds points or triangles of the input.
  void add(std::uint64_t items) { items_ += items; }

 private:
  std::uint64_t items_;
  std::clock_t begin_ = std::clock();
};

/// The input as a file in memory, so that readers use their ordinary code for files.
class MemoryFile {
 public:
  MemoryFile(const std::uint8_t* data, std::size_t size) : fd_(memfd_create("fuzz", 0)) {
    require(fd_ >= 0 && write(fd_, data, size) == static_cast<ssize_t>(size), "memfd");
    name_ = "/proc/self/fd/" + std::to_string(fd_);
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  int fd_;
  std::string name_;
};

/// The result of reading a file: a hash of its points, or an Error.
struct ReadResult {
  bool refused = false;
  std::uint64_t points = 0;
  std::uint64_t empty_values = 0;
  std::uint64_t hash = 0;

  friend bool operator==(const ReadResult&, const ReadResult&) = default;
};

/// Reads a complete file and checks the reader's guarantees: blocks and columns of the right size,
/// finite coordinates, no exceptions except Error.
inline ReadResult read_all_points(const std::string& file, const SourceOptions& options) {
  ReadResult reading;
  const auto fold = [&](const void* bytes, std::size_t size) {
    const auto* at = static_cast<const unsigned char*>(bytes);
    for (std::size_t i = 0; i < size; ++i) reading.hash = reading.hash * 1099511628211u + at[i];
  };
  try {
    const auto source = open_source(std::span(&file, 1), options);
    const std::size_t record = source->info().payload_size();
    PointBlock block;
    while (source->next(block)) {
      require(!block.empty() && block.size() <= options.block_points, "blocks have the right size");
      require(block.payload.size() == block.size() * record, "records have the right size");
      for (std::size_t i = 0; i < block.size(); ++i) {
        for (const double value : block.positions[i]) {
          require(value - value == 0.0, "coordinates are finite");
        }
        // In the order of the points, so that the hash does not depend on the block size.
        fold(&block.positions[i], sizeof(Point3));
        fold(block.payload.data() + i * record, record);
      }
      reading.points += block.size();
    }
    require(block.empty(), "the block at the end is empty");
    require(source->progress().points == reading.points, "progress agrees with the points");
    const auto promised = source->info().points;
    const Progress done = source->progress();
    reading.empty_values = done.empty_values;
    require(done.empty_values <= reading.points * source->info().attributes.size(),
            "empty values do not exceed the values");
    require(!promised || *promised == reading.points + done.nodata + done.lost,
            "points agree with the announced number");
  } catch (const Error& error) {
    require(!error.parts().cause.empty(), "errors have a cause");
    reading = {.refused = true};
  }
  return reading;
}

/// Reads cells of a raster and checks the reader's guarantees. A few blocks suffice: sparse and
/// compressed files can be valid and very large.
inline void read_cells(PointSource& source, std::size_t block_points) {
  const SourceInfo& info = source.info();
  PointBlock block;
  std::uint64_t points = 0;
  for (int i = 0; i < 200 && source.next(block); ++i) {
    require(!block.empty() && block.size() <= block_points, "blocks have the right size");
    points += block.size();
    for (const Point3& p : block.positions) {
      require(p[0] >= 0 && p[0] < static_cast<double>(info.columns) && p[1] >= 0 &&
                  p[1] < static_cast<double>(info.rows) && p[2] - p[2] == 0.0,
              "points are cells of the raster with data");
    }
  }
  require(points <= *info.points, "points do not exceed the announced number");
}

}  // namespace terrace::stream
