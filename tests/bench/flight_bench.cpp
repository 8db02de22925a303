// SPDX-License-Identifier: GPL-3.0-or-later
// A camera flies over a store of 67 million points, with an error small enough to keep about
// 500,000 of them in the model: 600 frames, each moving by 1 % of the width of the visible ground.
// A frame may take 10 ms, reading and decoding included (the files are in the page cache). Measured
// in one thread, and with a second thread that reads, where a frame is the first thread's time.
//
// Uses the store that TERRACE_BENCH_STORE names and creates it if it does not exist; without the
// variable, makes one for this run. Exits with 1 if a flight did not reach the target of its view.
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string>
#include <thread>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "cli/cli.hpp"
#include "flight_path.hpp"
#include "flight_run.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/store_view.hpp"

namespace {

using terrace::stream::Store;
using namespace terrace::tests;
using View = terrace::terrain::StoreView<std::int32_t>;

std::size_t active() { return small() ? 20'000 : 500'000; }
constexpr double kBudget = 0.010;

Store open_store(const std::filesystem::path& folder) {
  const char* given = std::getenv("TERRACE_BENCH_STORE");
  terrace::terrain::BuildRequest request;
  request.store = given ? std::filesystem::path(given) : folder / "dem.store";
  if (std::filesystem::exists(request.store)) return Store::open(request.store);
  const std::string dem = (folder / "dem.tif").string();
  const std::array<const char*, 7> synth{
      "terrace", "synth", "dem", "--size", small() ? "512x512" : "8192x8192", "-o", dem.c_str()};
  if (terrace::tools::run_command_line(static_cast<int>(synth.size()), synth.data()) != 0) {
    std::exit(1);
  }
  request.inputs = {dem};
  request.block_points = small() ? 1000 : 10000;
  terrace::terrain::build_store(request,
                                {.threads = std::max(1u, std::thread::hardware_concurrency())});
  return Store::open(request.store);
}

int run() {
  const TemporaryFolder folder;
  const Store store = open_store(folder.path());
  warm(store);
  print_head(store, kBudget);
  int status = 0;
  for (const Kind kind : {Kind::perspective, Kind::map}) {
    Flight flight(store, kind, active());
    tune<View>(flight, store, active());
    for (const View::Reader reader : {View::Reader::in_frame, View::Reader::thread}) {
      std::string name = kind == Kind::map ? "map" : "perspective";
      name += reader == View::Reader::thread ? ", reader thread" : ", one thread";
      View viewer(store, {}, reader);
      const std::string what = fly(name.c_str(), flight, viewer, reader, store, kBudget);
      if (what.empty()) continue;
      std::fprintf(stderr, "%s: %s\n", name.c_str(), what.c_str());
      status = 1;
    }
  }
  return status;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "flight_bench: %s\n", error.what());
    return 1;
  }
}
