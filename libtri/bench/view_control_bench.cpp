// SPDX-License-Identifier: Apache-2.0
// A camera flies over a grid of points in clusters of about 140, on three levels, with an error
// chosen such that about 500,000 points are in the model. There are 600 frames. Each moves by 1 %
// of the width of the view and has one step of at most 10 ms. The clusters that a step requests are
// given before the next one.
//
// Times are in milliseconds per step. `at_target`: share of the frames after whose step no greater
// error is visible. `stop_frames`: steps until a view that stopped is at its target and nothing is
// left to do. `decide`: a step that finds nothing to do.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <random>
#include <vector>

#include <benchmark/benchmark.h>

#include "multiresolution_hierarchy.hpp"
#include "terrace/tri/geomorph.hpp"
#include "terrace/tri/view.hpp"

namespace terrace::tri::bench {
namespace {

using Control = ViewControl2<std::int32_t>;

bool small() { return std::getenv("TERRACE_BENCH_SMALL") != nullptr; }
int side() { return small() ? 400 : 3072; }
std::size_t active() { return small() ? 20'000 : 500'000; }
int frames() { return small() ? 60 : 600; }

ArraySource& source() {
  static std::mt19937_64 random(1);
  static ArraySource hierarchy = make_hierarchy(grid_points(side()), 2, 140.0, random);
  return hierarchy;
}

std::vector<std::uint64_t> counts() {
  return {source().cluster_count(0), source().cluster_count(1)};
}

enum Kind { kPerspective, kMap };

/// The camera's path is a circle about the middle, looking ahead and down; for the map, straight
/// down.
struct Flight {
  Kind kind;
  double middle = side() / 2.0, radius = side() * 0.22;
  double height = kind == kPerspective ? side() * 0.065 : 10.0;
  double scale = 1.0;  // of the map's view

  [[nodiscard]] double view_height() const {
    return scale * std::sqrt(static_cast<double>(active()) / 1.5);
  }
  [[nodiscard]] double width() const {
    if (kind == kMap) return 1.5 * view_height();
    return 2.0 * (2.0 * height) * std::tan(30.0 * std::acos(-1.0) / 180.0) * 1.5;
  }
  [[nodiscard]] Camera camera(double distance) const {
    const double angle = distance / radius, c = std::cos(angle), s = std::sin(angle);
    Pose pose;
    pose.position = {middle + radius * c, middle + radius * s, height};
    if (kind == kMap) {
      pose.direction = {0, 0, -1};
      return orthographic_camera(pose, view_height(), 1.5, 1080.0);
    }
    pose.direction = {-s * std::sqrt(0.75), c * std::sqrt(0.75), -0.5};
    pose.up = {0, 0, 1};
    return perspective_camera(pose, 60.0, 1.5, 1080.0);
  }
};

std::unique_ptr<Control> settled(const View& view) {
  auto control = std::make_unique<Control>(counts(), load_root(source()));
  for (;;) {
    const auto& step = control->step(view);
    const std::vector<ViewRequest> wanted = step.wanted;
    if (step.settled && wanted.empty()) return control;
    for (const ViewRequest& request : wanted) control->give(load(source(), request));
  }
}

/// Finds the error at which the model has about the wanted number of points.
double pixel_error_for(const Flight& flight) {
  double low = 0.01, high = 1000.0;
  for (int i = 0; i < 10; ++i) {
    View view;
    view.camera = flight.camera(0.0);
    view.pixel_error = std::sqrt(low * high);
    if (settled(view)->model().point_count() > active()) {
      low = view.pixel_error;
    } else {
      high = view.pixel_error;
    }
  }
  return high;
}

void flight(benchmark::State& state, Kind kind, bool heights) {
  Flight path{kind};
  View view;
  // The map is at full resolution. In perspective the error decides.
  view.pixel_error = kind == kMap ? 0.01 : pixel_error_for(path);
  view.camera = path.camera(0.0);
  ViewOptions options;
  options.model.old_heights = heights;
  StepBudget budget;
  budget.seconds = 0.010;
  budget.clock = [] {
    return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
  };
  for (auto _ : state) {
    Control control(counts(), load_root(source()), options);
    std::vector<double> times, gives, morphs;
    Geomorph2<std::int32_t> morph;
    double points = 0.0, changed = 0.0;
    std::size_t at_target = 0;
    const auto frame = [&](bool measure) -> bool {
      double seconds = 0.0, loading = 0.0;
      const Control::Step* step = nullptr;
      {
        const Lap lap(seconds);
        step = &control.step(view, budget);
      }
      const bool done = step->settled && step->wanted.empty();
      if (measure) {
        times.push_back(1e3 * seconds);
        at_target += step->worst <= 1.0;
        points += static_cast<double>(control.model().point_count());
        if (heights) {
          double slide = 0.0;
          {
            const Lap lap(slide);
            morph.make(control.model(), *step->delta);
          }
          morphs.push_back(1e3 * slide);
        }
        changed += static_cast<double>(step->delta->changes.added_vertices.size() +
                                       step->delta->changes.removed_vertices.size());
      }
      const std::vector<ViewRequest> requests = step->requests;
      {
        const Lap lap(loading);
        for (const ViewRequest& request : requests) control.give(load(source(), request));
      }
      if (measure) gives.push_back(1e3 * loading);
      return done;
    };
    while (!frame(false)) {
    }
    const double each = 0.01 * path.width();
    double at = 0.0;
    for (int i = 0; i < frames(); ++i) {
      at += each;
      view.camera = path.camera(at);
      frame(true);
    }
    const auto flown = static_cast<double>(times.size());
    const std::size_t on_target = at_target;
    int stop = 1;
    while (!frame(true)) ++stop;
    double decide = 0.0;
    {
      const Lap lap(decide);
      control.step(view, budget);
    }
    times.resize(static_cast<std::size_t>(flown));
    gives.resize(times.size());
    std::sort(times.begin(), times.end());
    std::sort(gives.begin(), gives.end());
    const auto quantile = [](const std::vector<double>& sorted, double q) {
      return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
    };
    state.counters["p50"] = quantile(times, 0.5);
    state.counters["p99"] = quantile(times, 0.99);
    state.counters["max"] = times.back();
    state.counters["give_p99"] = quantile(gives, 0.99);
    if (heights) {
      std::sort(morphs.begin(), morphs.end());
      state.counters["morph_p50"] = quantile(morphs, 0.5);
    }
    state.counters["decide"] = 1e3 * decide;
    state.counters["at_target"] = static_cast<double>(on_target) / flown;
    state.counters["stop_frames"] = stop;
    state.counters["points"] = points / flown;
    state.counters["changed"] = changed / flown;
    state.counters["clusters"] = static_cast<double>(control.model().expanded_count());
    state.counters["pixel_error"] = view.pixel_error;
    state.counters["other_MB"] = static_cast<double>(control.memory_bytes()) / 1e6;
  }
}

BENCHMARK_CAPTURE(flight, perspective, kPerspective, false)
    ->Iterations(1)
    ->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(flight, map, kMap, false)->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(flight, map_geomorphs, kMap, true)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace terrace::tri::bench

BENCHMARK_MAIN();
