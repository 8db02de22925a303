// SPDX-License-Identifier: GPL-3.0-or-later
// A camera flies over a store of 67 million points, with as tight an error as keeps about 500,000
// of them in the model: 600 frames, each moving by 1 % of the width of what is seen, 10 ms at most
// per frame, reading and decoding what is wanted included (the files are in the page cache). In one
// thread, and with a second one that reads: then a frame is what the first one does.
//
// The store is the one that TERRACE_BENCH_STORE names, made there if nothing is there; else one
// made for this run. Exit 1: a flight did not end at what its view asks for.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <sys/resource.h>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "cli/cli.hpp"
#include "flight_path.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/store_view.hpp"

namespace {

using terrace::stream::Store;
using namespace terrace::tests;
namespace tri = terrace::tri;
using View = terrace::terrain::StoreView<std::int32_t>;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

bool small() { return std::getenv("TERRACE_BENCH_SMALL") != nullptr; }
std::size_t active() { return small() ? 20'000 : 500'000; }
int frames() { return small() ? 60 : 600; }
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

/// Reads every byte once: what is measured is not the disk.
void warm(const Store& store) {
  for (unsigned level = 0; level <= store.top(); ++level) {
    store.for_each(level, [](terrace::stream::ClusterId, const terrace::stream::ClusterRecord&,
                             const terrace::stream::ClusterPoints&) {});
  }
}

/// Frames until nothing is left to do; 0 if that takes more than 100,000.
int settle(View& viewer, View::Reader reader, const tri::View& view, double seconds) {
  for (int frame = 1; frame <= 100'000; ++frame) {
    viewer.frame(view, seconds);
    if (viewer.settled()) return frame;
    if (reader == View::Reader::thread) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return 0;
}

/// Sets the scale at which the model has about the wanted number of points at the start.
void tune(Flight& flight, const Store& store) {
  double low = 1e-3, high = 1e3;
  for (int i = 0; i < 14; ++i) {
    flight.scale = std::sqrt(low * high);
    tri::ViewOptions options;
    options.max_points = 2 * active();
    View viewer(store, options, View::Reader::in_frame);
    settle(viewer, View::Reader::in_frame, flight.view(0.0), 1.0);
    (viewer.model().point_count() > active() ? high : low) = flight.scale;
  }
  flight.scale = low;
}

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double quantile(const std::vector<double>& sorted, double q) {
  return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
}

/// At the end of the flight: the points of the expanded clusters, each once.
std::string fault(const View& viewer, const Store& store, int stop, double worst) {
  const auto& model = viewer.model();
  if (stop == 0) return "the view that stopped is never at its target";
  if (worst > 1.0) return "the view that stopped is settled and not at its target";
  std::uint64_t points = store.levels()[store.top()].members;
  for (const tri::ClusterId id : model.expanded()) {
    points +=
        store.record(terrace::stream::cluster_id(tri::level_of(id), tri::ordinal_of(id))).points;
  }
  if (points != model.point_count() || points != model.triangulation().vertex_count()) {
    return "the model does not have the points of the expanded clusters";
  }
  return {};
}

std::string fly(const char* name, const Flight& flight, View& viewer, View::Reader reader,
                const Store& store) {
  settle(viewer, reader, flight.view(0.0), kBudget);
  const terrace::terrain::ViewTraffic before = viewer.traffic();
  std::vector<double> times;
  double points = 0.0, changed = 0.0, spent = cpu_seconds();
  int at_target = 0;
  tri::View view;
  for (int i = 1; i <= frames(); ++i) {
    view = flight.view(i * 0.01 * flight.width());
    const double begin = now();
    const View::Step& step = viewer.frame(view, kBudget);
    times.push_back(now() - begin);
    at_target += step.worst <= 1.0;
    points += static_cast<double>(viewer.model().point_count());
    changed += static_cast<double>(step.delta->changes.added_vertices.size() +
                                   step.delta->changes.removed_vertices.size());
    // A second thread has as long as a display leaves it.
    const double rest = kBudget - times.back();
    if (reader == View::Reader::thread && rest > 0.0) {
      std::this_thread::sleep_for(std::chrono::duration<double>(rest));
    }
  }
  spent = cpu_seconds() - spent;
  int stop = 0;
  double worst = 2.0;
  for (bool settled = false; !settled && stop < 10'000;) {
    const double begin = now();
    const View::Step& step = viewer.frame(view, kBudget);
    ++stop;
    settled = viewer.settled();
    worst = step.worst;
    const double rest = kBudget - (now() - begin);
    if (reader == View::Reader::thread && !settled && rest > 0.0) {
      std::this_thread::sleep_for(std::chrono::duration<double>(rest));
    }
  }
  const terrace::terrain::ViewTraffic after = viewer.traffic();
  std::sort(times.begin(), times.end());
  const double count = frames();
  std::printf("%-27s %6.2f %6.2f %6.2f %9.2f %9.1f %6d %9.0f %8.0f %9zu %10.2f %8.2f %7.2f\n", name,
              1e3 * quantile(times, 0.5), 1e3 * quantile(times, 0.99), 1e3 * times.back(),
              1e3 * spent / count, 100.0 * at_target / count, stop, points / count, changed / count,
              static_cast<std::size_t>(after.clusters - before.clusters),
              static_cast<double>(after.points - before.points) / 1e6,
              static_cast<double>(after.bytes - before.bytes) / 1e6, view.pixel_error);
  std::fflush(stdout);
  return fault(viewer, store, stop, worst);
}

int run() {
  const TemporaryFolder folder;
  const Store store = open_store(folder.path());
  warm(store);
  std::printf(
      "%d frames over a store of %llu points, each moving by 1 %% of the width of what is seen;\n"
      "milliseconds of the thread that draws, CPU of all, at most %.0f ms asked for\n"
      "%-27s %6s %6s %6s %9s %9s %6s %9s %8s %9s %10s %8s %7s\n",
      frames(), static_cast<unsigned long long>(store.points()), 1e3 * kBudget, "flight", "p50",
      "p99", "max", "CPU/frame", "at target", "stop", "vertices", "changed", "clusters", "points",
      "read", "error");
  std::printf("%-27s %6s %6s %6s %9s %9s %6s %9s %8s %9s %10s %8s %7s\n", "", "ms", "ms", "ms",
              "ms", "% frames", "frames", "mean", "/ frame", "decoded", "decoded, M", "MB",
              "pixels");
  int status = 0;
  for (const Kind kind : {Kind::perspective, Kind::map}) {
    Flight flight(store, kind, active());
    tune(flight, store);
    for (const View::Reader reader : {View::Reader::in_frame, View::Reader::thread}) {
      std::string name = kind == Kind::map ? "map" : "perspective";
      name += reader == View::Reader::thread ? ", reader thread" : ", one thread";
      View viewer(store, {}, reader);
      const std::string what = fly(name.c_str(), flight, viewer, reader, store);
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
