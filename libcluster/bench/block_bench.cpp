// SPDX-License-Identifier: Apache-2.0
// Block clustering: measures points per second for each effort and instruction set, and the cost Q
// relative to the reference search. Blocks have 10,000 points (TERRACE_BENCH_SMALL: 576) of
//   dem   square tiles of a fractal elevation model, cells of 30 m, neighbours differ by 2.65 m
//   scan  patches 500 points wide of a bumpy closed surface
//   shuf  the scan shuffled: each block is a coarse copy of the whole surface
//   cube  uniform in a cube
// Counters: Q_tenth, Q_log10 and Q_log2 are the percentages above (below, if negative) the cost of
// the thesis's search from Meyerson's start with 0.1 m, m ceil(log10 m) (the thesis's "full
// number") and m ceil(log2 m) candidates, mean over blocks. Also clusters per block and the median
// of their sizes.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <optional>
#include <stdexcept>

#include <benchmark/benchmark.h>

#include "../tests/inputs.hpp"
#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"

namespace {

using namespace terrace::cluster;

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;
const std::size_t kSide = kSmall ? 24 : 100;
const std::size_t kBlockSize = kSide * kSide;
const std::size_t kBlocks = kSmall ? 2 : 16;
constexpr std::uint64_t kSeed = 20;

constexpr std::array kInputs{"dem", "scan", "shuf", "cube"};
constexpr std::array kEfforts{"fast", "standard", "fine", "full"};
constexpr std::array kPaths{SimdPath::portable, SimdPath::avx2, SimdPath::avx512};
constexpr std::array kPathNames{"portable", "avx2", "avx512"};

constexpr std::array kLengths{Effort::standard, Effort::fine, Effort::full};
constexpr std::array kLengthNames{"Q_tenth_%", "Q_log10_%", "Q_log2_%"};

struct Input {
  std::vector<std::vector<Point3>> blocks;
  std::array<std::vector<double>, kLengths.size()> costs;  // of the reference search, per block
};

Input make_input(std::size_t number) {
  std::mt19937_64 random(kSeed);
  std::vector<Point3> points;
  if (number == 0) {
    points = inputs::dem_tiles(4 * kSide, kSide, 30.0, 2.65, random);
  } else if (number == 3) {
    points = inputs::cube(kBlocks * kBlockSize, random);
  } else {
    points = kSmall ? inputs::scan(2, 40, random) : inputs::scan(4, 500, random);
    if (number == 2) inputs::shuffle(points, random);
  }
  Input input;
  const std::size_t all = points.size() / kBlockSize;
  for (std::size_t b = 0; b < kBlocks; ++b) {
    const auto first = points.begin() + static_cast<std::ptrdiff_t>(b * all / kBlocks * kBlockSize);
    input.blocks.emplace_back(first, first + static_cast<std::ptrdiff_t>(kBlockSize));
    for (std::size_t k = 0; k < kLengths.size(); ++k) {
      const FacilityPoints problem{.points = input.blocks.back()};
      const FacilitySolution solution = solve(problem, {.effort = kLengths[k], .seed = b + 1});
      input.costs[k].push_back(solution.cost());
    }
  }
  return input;
}

/// Makes the input on first use, so that a filtered run makes only what it needs.
const Input& input_of(std::size_t number) {
  static std::array<std::optional<Input>, kInputs.size()> inputs;
  if (!inputs[number]) inputs[number] = make_input(number);
  return *inputs[number];
}

void report_quality(benchmark::State& state, const Input& input, BlockClusterer& clusterer,
                    Effort effort) {
  std::array<double, kLengths.size()> ratios{};
  std::vector<std::size_t> sizes;
  BlockClustering clustering;
  for (std::size_t b = 0; b < input.blocks.size(); ++b) {
    clusterer.run(input.blocks[b], {}, {.effort = effort, .seed = b + 1}, clustering);
    for (std::size_t k = 0; k < ratios.size(); ++k) {
      ratios[k] += clustering.cost() / input.costs[k][b];
    }
    std::vector<std::size_t> block_sizes(clustering.facilities.size(), 0);
    for (const std::uint32_t cluster : clustering.assignment) ++block_sizes[cluster];
    sizes.insert(sizes.end(), block_sizes.begin(), block_sizes.end());
  }
  const auto blocks = static_cast<double>(input.blocks.size());
  for (std::size_t k = 0; k < ratios.size(); ++k) {
    state.counters[kLengthNames[k]] = 100.0 * (ratios[k] / blocks - 1.0);
  }
  state.counters["clusters"] = static_cast<double>(sizes.size()) / blocks;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  state.counters["median_size"] = static_cast<double>(*middle);
}

void cluster_blocks(benchmark::State& state, std::size_t number, Effort effort, SimdPath path) {
  std::optional<BlockClusterer> clusterer;
  try {
    clusterer.emplace(path);
  } catch (const std::invalid_argument&) {
    state.SkipWithError("this processor lacks the instructions");
    return;
  }
  const Input& input = input_of(number);
  BlockClustering clustering;
  std::size_t b = 0;
  std::size_t points = 0;
  for ([[maybe_unused]] const auto iteration : state) {
    clusterer->run(input.blocks[b], {}, {.effort = effort, .seed = b + 1}, clustering);
    benchmark::DoNotOptimize(clustering.assignment.data());
    points += input.blocks[b].size();
    b = (b + 1) % input.blocks.size();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(points));
  report_quality(state, input, *clusterer, effort);
}

/// Runs the textbook search by full scans with 0.1 m candidates, for comparison.
void reference(benchmark::State& state, std::size_t number) {
  const FacilityPoints problem{.points = input_of(number).blocks[0]};
  for ([[maybe_unused]] const auto iteration : state) {
    benchmark::DoNotOptimize(solve(problem, {.strategy = FacilityStrategy::full_scan}).cost());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kBlockSize));
}

}  // namespace

int main(int argc, char** argv) {
  for (std::size_t number = 0; number < kInputs.size(); ++number) {
    const std::string input = kInputs[number];
    for (std::size_t path = kPaths.size(); path-- > 0;) {
      for (std::size_t effort = 0; effort < kEfforts.size(); ++effort) {
        if (kPaths[path] == SimdPath::portable && effort != 1) continue;
        const std::string name = input + "/" + kEfforts[effort] + "/" + kPathNames[path];
        benchmark::RegisterBenchmark(name.c_str(), cluster_blocks, number,
                                     static_cast<Effort>(effort), kPaths[path]);
      }
    }
    benchmark::RegisterBenchmark((input + "/reference search 0.1 m").c_str(), reference, number);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
