// SPDX-License-Identifier: GPL-3.0-or-later
// What questions to a store cost, on the store that TERRACE_BENCH_STORE names or else on one made
// here of a fractal elevation model of 2049 x 2049 samples.
#include <array>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <terrace/stream/store.hpp>

#include "../pipeline/temporary_folder.hpp"
#include "cli.hpp"
#include "store_build.hpp"
#include "store_window.hpp"

namespace {

using terrace::stream::Store;

bool small() { return std::getenv("TERRACE_BENCH_SMALL") != nullptr; }

const Store& store() {
  static const terrace::tests::TemporaryFolder folder;
  static const Store opened = [] {
    if (const char* given = std::getenv("TERRACE_BENCH_STORE")) return Store::open(given);
    const std::string dem = (folder.path() / "dem.tif").string();
    const std::array<const char*, 7> synth{
        "terrace", "synth", "dem", "--size", small() ? "257x257" : "2049x2049", "-o", dem.c_str()};
    if (terrace::tools::run_command_line(static_cast<int>(synth.size()), synth.data()) != 0)
      std::exit(1);
    terrace::tools::BuildRequest request;
    request.inputs = {dem};
    request.store = folder.path() / "dem.store";
    request.threads = 2;
    terrace::tools::build_store(request);
    return Store::open(request.store);
  }();
  return opened;
}

/// All samples, window by window, floats; the argument is a window's side.
void windows(benchmark::State& state) {
  const Store& source = store();  // made before the clock runs
  const auto side = state.range(0);
  const auto columns = static_cast<std::int64_t>(source.schema().columns);
  const auto rows = static_cast<std::int64_t>(source.schema().rows);
  std::vector<float> heights(static_cast<std::size_t>(side * side));
  for (auto _ : state) {
    terrace::tools::StoreWindow reader(source);
    for (std::int64_t row = 0; row < rows; row += side) {
      for (std::int64_t column = 0; column < columns; column += side) {
        reader.heights({column, row, side, side}, std::span(heights));
        benchmark::DoNotOptimize(heights.data());
      }
    }
  }
  state.SetItemsProcessed(state.iterations() * columns * rows);
}
BENCHMARK(windows)->Arg(128)->Arg(512)->Unit(benchmark::kMillisecond);

/// The same window over and over: what the cache keeps.
void same_window(benchmark::State& state) {
  const Store& source = store();
  const auto side = state.range(0);
  std::vector<float> heights(static_cast<std::size_t>(side * side));
  terrace::tools::StoreWindow reader(source, std::uint64_t{16} << 20);
  for (auto _ : state) {
    reader.heights({10, 10, side, side}, std::span(heights));
    benchmark::DoNotOptimize(heights.data());
  }
  state.SetItemsProcessed(state.iterations() * side * side);
}
BENCHMARK(same_window)->Arg(64)->Arg(256)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
