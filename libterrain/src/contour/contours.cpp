// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/contours.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>

#include "base/available_memory.hpp"
#include "base/progress_report.hpp"
#include "base/store_checks.hpp"
#include "base/units.hpp"
#include "contour/parts.hpp"
#include "contour/text.hpp"
#include "earth/ground.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// Memory in bytes per point of an unfinished line (the vector doubles as it grows).
constexpr std::uint64_t kContourBytesPerPoint = 48;
constexpr double kMaxLevels = 1e15;
/// Drawing more levels than this would practically never end.
constexpr double kMaxLevelsDrawn = 1e7;

stream::Error fault(const stream::Store& store, stream::Message cause) {
  return {store.path().string(), std::move(cause)};
}

/// Throws: stream::Error if the interval is too small for the heights.
void check_levels(const stream::Store& store, const ContourRequest& request) {
  const stream::Channel& z = store.schema().coordinates[2];
  const auto level = [&](double raw) { return (raw * z.scale + z.offset) / request.interval; };
  const stream::Box3& bounds = store.bounds();
  if (std::max(std::abs(level(bounds.min[2])), std::abs(level(bounds.max[2]))) > kMaxLevels) {
    throw fault(store,
                fmt::format("heights have too many levels of {}", plain_number(request.interval)))
        .remedy(stream::message("pass a larger {interval}"));
  }
  double low = bounds.min[2], high = bounds.max[2];
  if (request.region) {
    stream::StoreQuery query(store);
    const GroundSlope ground(store);
    const auto heights = cluster_heights(query, box_around(*request.region, ground));
    if (!heights) return;
    low = heights->low;
    high = heights->high;
  }
  const double levels = std::abs(level(high) - level(low));
  if (levels <= kMaxLevelsDrawn) return;
  throw fault(
      store,
      fmt::format("between the lowest and the highest point there are {} of {}, more than {}",
                  counted(static_cast<std::uint64_t>(levels), "level"),
                  plain_number(request.interval),
                  with_commas(static_cast<std::uint64_t>(kMaxLevelsDrawn))))
      .remedy(stream::message("pass a larger {interval}"));
}

/// Returns why there are no lines although the store has points.
stream::Message reason_for_none(const stream::Store& store, const ContourRequest& request) {
  const std::string interval = plain_number(request.interval);
  const stream::Channel& z = store.schema().coordinates[2];
  const auto height = [&](double raw) { return raw * z.scale + z.offset; };
  const auto [low, high] =
      std::minmax({height(store.bounds().min[2]), height(store.bounds().max[2])});
  if ((std::floor(low / request.interval) + 1.0) * request.interval >= high) {
    return stream::message("no multiple of {interval} {} is between the heights, {} to {}",
                           interval, readable_number(low, 10), readable_number(high, 10));
  }
  if (request.max_edge) {
    return stream::message(
        "no triangle with sides of up to {} m crosses a multiple of {interval} {}",
        plain_number(*request.max_edge), interval);
  }
  if (request.region) {
    return stream::message("inside the region no multiple of {interval} {} is crossed", interval);
  }
  if (request.max_error) {
    return stream::message("no triangle of the surface crosses a multiple of {interval} {}",
                           interval);
  }
  if (store.schema().grid && request.level == 0) {
    return stream::message(
        "no square of four neighbouring samples with data crosses a multiple of {interval} {}",
        interval);
  }
  if (request.level == 0) return "the points are on one line, so they span no triangles";
  return stream::message(
      "no triangle of the points of level {}{} crosses a multiple of {interval} {}", request.level,
      request.focuses.empty() ? "" : " and of the focuses", interval);
}

}  // namespace

StoredBox box_around(const Region& region, const GroundSlope& ground) {
  const stream::Box3& world = region.box();
  StoredBox box;
  for (unsigned corner = 0; corner < 4; ++corner) {
    const Point2 p = ground.stored(
        {(corner & 1 ? world.max : world.min)[0], (corner & 2 ? world.max : world.min)[1]});
    for (std::size_t axis = 0; axis < 2; ++axis) {
      box.min[axis] = corner == 0 ? p[axis] : std::min(box.min[axis], p[axis]);
      box.max[axis] = corner == 0 ? p[axis] : std::max(box.max[axis], p[axis]);
    }
  }
  return box;
}

bool reaches_into(const StoredBox& box, const Region& region, const GroundSlope& ground) {
  constexpr double kAnyHeight = std::numeric_limits<double>::infinity();
  stream::Box3 world;
  for (unsigned corner = 0; corner < 4; ++corner) {
    const Point2 p =
        ground.world({(corner & 1 ? box.max : box.min)[0], (corner & 2 ? box.max : box.min)[1]});
    world.include(stream::Box3{{p[0], p[1], -kAnyHeight}, {p[0], p[1], kAnyHeight}});
  }
  return region.overlap(world) != Overlap::none;
}

ContourOutcome write_contours(const stream::Store& input, const ContourRequest& request,
                              const std::function<void(std::string_view)>& write,
                              const Context& context) {
  need_terrain(input, "a contour");
  const stream::Store store = input.with_stop(context.stop);
  const std::uint64_t memory = working_memory(context);
  need_level(store, request.level);
  if (store.points() > 0) check_levels(store, request);
  ContourText text(store, request, context.threads, write);
  const ProgressReport report(context, "lines");
  ContourParts parts{
      .store = store,
      .request = request,
      .threads = std::max(1U, context.threads),
      .memory_bytes = memory,
      .emit = [&](ContourLine&& line) { text.add(std::move(line)); },
      .limit =
          {.points = memory / 3 / kContourBytesPerPoint,
           .exceeded =
               [&] {
                 throw fault(
                     store,
                     stream::message(
                         "unfinished contour lines have more than {}, too many for {memory_bytes}",
                         counted(memory / 3 / kContourBytesPerPoint, "point")))
                     .remedy(stream::message(
                         "raise {memory_bytes} or {interval}, or choose a smaller {region}"));
               },
           .stop = context.stop},
      .progress = [&](double share) { report.update(text.outcome().lines, share); },
  };
  if (request.max_error) {
    say_unknown_height_unit(Ground(store.schema()), context);
    draw_bounded_contours(parts);
  } else if (store.schema().grid && request.level == 0) {
    draw_lattice_contours(parts);
  } else {
    draw_point_contours(parts);
  }
  text.finish();
  if (text.outcome().lines == 0) {
    context.say(stream::message("there are no lines: {}", store.points() == 0
                                                              ? "the store has no points"
                                                              : reason_for_none(store, request)));
  }
  return text.outcome();
}

}  // namespace terrace::terrain
