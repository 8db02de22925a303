// SPDX-License-Identifier: GPL-3.0-or-later
// Time of `terrace build` without reading, encoding and writing: points are read into memory first,
// and only the hierarchy is timed, with a sink that drops everything. For table 7.2 of J. Skála,
// Algorithms for manipulating large geometric data: see thesis_store.py.
//
// usage: hierarchy_time FILE BLOCK FACILITY_COST THREADS
// Prints {"points": N, "seconds": S}.
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include <terrace/cluster/hierarchy.hpp>
#include <terrace/stream/source.hpp>

#include "earth/ground.hpp"

namespace {

using terrace::cluster::ClusteredBlock;
using Clock = std::chrono::steady_clock;

class NullSink : public terrace::cluster::HierarchySink {
 public:
  std::unique_ptr<Prepared> prepare(const ClusteredBlock&) override { return nullptr; }
  void commit(unsigned, std::unique_ptr<Prepared>) override {}
  void root(const ClusteredBlock&) override {}
};

// Number of points in memory at once (400 MB); the clock stops while the next part is read.
constexpr std::size_t kPart = std::size_t{1} << 24;

int measure(const std::string& file, std::size_t block_points, double facility_cost,
            unsigned threads) {
  terrace::stream::SourceOptions source_options;
  source_options.block_points = block_points;
  const std::array files{file};
  const auto source = terrace::stream::open_source(files, source_options);
  const terrace::terrain::Ground ground(source->info());

  NullSink sink;
  terrace::cluster::HierarchyOptions options;
  options.block_size = block_points;
  options.block.facility_cost = facility_cost;
  options.threads = threads;
  options.ground = [&ground](const terrace::base::Box3& bounds) {
    return ground.map({bounds.min, bounds.max});
  };
  terrace::cluster::HierarchyBuilder builder(options, sink);

  std::chrono::duration<double> seconds{0.0};
  std::uint64_t points = 0;
  std::vector<std::vector<terrace::cluster::Point3>> part;
  terrace::stream::PointBlock block;
  for (bool more = true; more;) {
    part.clear();
    for (std::size_t size = 0; size < kPart && (more = source->next(block));) {
      size += block.size();
      part.emplace_back(block.positions.begin(), block.positions.end());
    }
    const auto start = Clock::now();
    for (const auto& positions : part) builder.push(positions);
    if (!more) points = builder.finish().points;
    seconds += Clock::now() - start;
  }
  std::printf("{\"points\": %llu, \"seconds\": %.9g}\n", static_cast<unsigned long long>(points),
              seconds.count());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: %s FILE BLOCK FACILITY_COST THREADS\n", argv[0]);
    return 2;
  }
  try {
    return measure(argv[1], std::strtoull(argv[2], nullptr, 10), std::strtod(argv[3], nullptr),
                   static_cast<unsigned>(std::strtoul(argv[4], nullptr, 10)));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[1], error.what());
    return 1;
  }
}
