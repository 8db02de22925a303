// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include <sys/resource.h>
#include <time.h>

#include "terrace/terrain/store_view.hpp"

/// A measured flight over a store of terrain or of a scan, frame by frame.

namespace terrace::tests {

inline double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

inline bool small() { return std::getenv("TERRACE_BENCH_SMALL") != nullptr; }

/// Reads every byte once, so that the disk is not measured.
inline void warm(const stream::Store& store) {
  for (unsigned level = 0; level <= store.top(); ++level) {
    store.for_each(level, [](stream::ClusterId, const stream::ClusterRecord&,
                             const stream::ClusterPoints&) {});
  }
}

/// Returns the number of frames until nothing is left to do, or 0 if that takes more than 100,000.
template <class View>
int settle(View& viewer, typename View::Reader reader, const tri::View& view, double seconds) {
  for (int frame = 1; frame <= 100'000; ++frame) {
    viewer.frame(view, seconds);
    if (viewer.settled()) return frame;
    if (reader == View::Reader::thread) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return 0;
}

/// Sets the scale at which the model starts with about the wanted number of points.
template <class View, class Path>
void tune(Path& flight, const stream::Store& store, std::size_t active) {
  double low = 1e-3, high = 1e3;
  for (int i = 0; i < 14; ++i) {
    flight.scale = std::sqrt(low * high);
    tri::ViewOptions options;
    options.max_points = 2 * active;
    View viewer(store, options, View::Reader::in_frame);
    settle(viewer, View::Reader::in_frame, flight.view(0.0), 1.0);
    (viewer.model().point_count() > active ? high : low) = flight.scale;
  }
  flight.scale = low;
}

inline double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// Processor time of the calling thread. Measures a frame independently of the machine's other
/// load.
inline double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

inline double quantile(const std::vector<double>& sorted, double q) {
  return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
}

inline int frames() { return small() ? 60 : 600; }

/// share: how far each frame moves, as a fraction of the visible width.
inline void print_head(const stream::Store& store, double budget, double share = 0.01) {
  std::printf(
      "%d frames over a store of %llu points, each moving by %g %% of the visible width;\n"
      "milliseconds of the drawing thread, CPU of all threads, budget %.0f ms\n"
      "%-27s %6s %6s %6s %7s %9s %9s %6s %9s %8s %9s %10s %8s %7s\n",
      frames(), static_cast<unsigned long long>(store.points()), 100.0 * share, 1e3 * budget,
      "flight", "p50", "p99", "max", "p99 CPU", "CPU/frame", "at target", "stop", "vertices",
      "changed", "clusters", "points", "read", "error");
  std::printf("%-27s %6s %6s %6s %7s %9s %9s %6s %9s %8s %9s %10s %8s %7s\n", "", "ms", "ms", "ms",
              "ms", "ms", "% frames", "frames", "mean", "/ frame", "decoded", "decoded, M", "MB",
              "pixels");
}

/// Checks that at the end of the flight the model has each point of the expanded clusters once.
/// Returns the error, or an empty string.
template <class View>
std::string fault(const View& viewer, const stream::Store& store, int stop, double worst) {
  const auto& model = viewer.model();
  if (stop == 0) return "the stopped view never reaches its target";
  if (worst > 1.0) return "the stopped view settled short of its target";
  std::uint64_t points = store.levels()[store.top()].members;
  for (const tri::ClusterId id : model.expanded()) {
    points += store.record(id).points;
  }
  // Points of a scan may coincide.
  const bool apart = store.schema().grid;
  if (points != model.point_count() || (apart && points != model.triangulation().vertex_count())) {
    return "the model does not have the points of the expanded clusters";
  }
  return {};
}

/// Flies 600 frames, each moving by this fraction of the visible width, in at most `budget` seconds
/// each, then holds the view until it reaches its target. Prints a line below print_head(). Returns
/// the error, or an empty string.
template <class View, class Path>
std::string fly(const char* name, const Path& flight, View& viewer, typename View::Reader reader,
                const stream::Store& store, double budget, double share = 0.01) {
  settle(viewer, reader, flight.view(0.0), budget);
  const terrain::ViewTraffic before = viewer.traffic();
  std::vector<double> times, own_times;
  double points = 0.0, changed = 0.0, spent = cpu_seconds();
  int at_target = 0;
  tri::View view;
  for (int i = 1; i <= frames(); ++i) {
    view = flight.view(i * share * flight.width());
    const double begin = now(), own_begin = thread_seconds();
    const typename View::Step& step = viewer.frame(view, budget);
    own_times.push_back(thread_seconds() - own_begin);
    times.push_back(now() - begin);
    at_target += step.worst <= 1.0;
    points += static_cast<double>(viewer.model().point_count());
    changed += static_cast<double>(step.delta->changes.added_vertices.size() +
                                   step.delta->changes.removed_vertices.size());
    // Give the reading thread the time left until the display's next frame.
    const double rest = budget - times.back();
    if (reader == View::Reader::thread && rest > 0.0) {
      std::this_thread::sleep_for(std::chrono::duration<double>(rest));
    }
  }
  spent = cpu_seconds() - spent;
  int stop = 0;
  double worst = 2.0;
  for (bool settled = false; !settled && stop < 10'000;) {
    const double begin = now();
    const typename View::Step& step = viewer.frame(view, budget);
    ++stop;
    settled = viewer.settled();
    worst = step.worst;
    const double rest = budget - (now() - begin);
    if (reader == View::Reader::thread && !settled && rest > 0.0) {
      std::this_thread::sleep_for(std::chrono::duration<double>(rest));
    }
  }
  const terrain::ViewTraffic after = viewer.traffic();
  std::sort(times.begin(), times.end());
  std::sort(own_times.begin(), own_times.end());
  const double count = frames();
  std::printf("%-27s %6.2f %6.2f %6.2f %7.2f %9.2f %9.1f %6d %9.0f %8.0f %9zu %10.2f %8.2f %7.2f\n",
              name, 1e3 * quantile(times, 0.5), 1e3 * quantile(times, 0.99), 1e3 * times.back(),
              1e3 * quantile(own_times, 0.99), 1e3 * spent / count, 100.0 * at_target / count, stop,
              points / count, changed / count,
              static_cast<std::size_t>(after.clusters - before.clusters),
              static_cast<double>(after.points - before.points) / 1e6,
              static_cast<double>(after.bytes - before.bytes) / 1e6, view.pixel_error);
  std::fflush(stdout);
  return fault(viewer, store, stop, worst);
}

}  // namespace terrace::tests
