// SPDX-License-Identifier: Apache-2.0
#include "sample/raster_grid.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <terrace/base/portable_math.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/source.hpp>
#include <terrace/stream/store_query.hpp>

#include "base/decimal_multiples.hpp"
#include "base/store_checks.hpp"
#include "base/units.hpp"
#include "earth/region_crs.hpp"
#include "earth/source_crs.hpp"
#include "earth/whole_turns.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

constexpr double kMaxGridCells = 2147483647.0;

/// Returns the bounds of a store in its CRS. Those of a raster include half a cell around the outer
/// samples.
stream::Box3 area_of(const stream::Store& store) {
  stream::Box3 stored = store.bounds();
  if (store.schema().grid) {
    const auto last = [](std::uint64_t n) { return static_cast<double>(n) - 0.5; };
    stored.min = {-0.5, -0.5, 0};
    stored.max = {last(store.schema().columns), last(store.schema().rows), 0};
  }
  stored.min[2] = stored.max[2] = 0;
  return world_box(store.schema(), stored);
}

/// Returns the bounding box, in the output's CRS, of a box in the store's CRS.
stream::Box3 converted_box(const stream::Box3& box, const Transformation& to_output,
                           const stream::Store& store) {
  // Straight sides may become curves, so convert this many points of each.
  constexpr int kPoints = 256;
  std::vector<Point2> outline;
  for (int i = 0; i <= kPoints; ++i) {
    const double t = static_cast<double>(i) / kPoints;
    const double x = box.min[0] + t * (box.max[0] - box.min[0]);
    const double y = box.min[1] + t * (box.max[1] - box.min[1]);
    for (const Point2 p : {Point2{x, box.min[1]}, Point2{x, box.max[1]}, Point2{box.min[0], y},
                           Point2{box.max[0], y}}) {
      outline.push_back(p);
    }
  }
  to_output.forward(outline);
  const WholeTurns turns(middle_in(to_output, box)[0], to_output.to().turn());
  for (Point2& p : outline) p = turns(p);
  stream::Box3 result;
  for (const Point2& p : outline) {
    if (std::isfinite(p[0]) && std::isfinite(p[1])) result.include(stream::Point3{p[0], p[1], 0});
  }
  if (result.empty()) {
    throw stream::Error(store.path().string(),
                        fmt::format("the region is outside the area of {}", to_output.to().title()))
        .remedy(stream::message("choose another {to_crs} or a smaller {region}"));
  }
  return result;
}

std::uint64_t point_count(const stream::Store& store, unsigned level) {
  if (store.condition() == nullptr) return store.levels()[level].points;
  return stream::StoreQuery(store).count(store.bounds(), level);
}

double rounded_to_two_digits(double value) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                 std::chars_format::scientific, 1);
  double result = 0;
  std::from_chars(digits.data(), end.ptr, result);
  return result;
}

/// Returns the spacing of points in units of the store's CRS.
double spacing_of(const stream::Store& store, const stream::Box3& area, unsigned level) {
  const std::array<double, 6>& world = store.schema().world.xy;
  if (store.schema().grid && level == 0)
    return std::sqrt(std::abs(world[0] * world[4] - world[1] * world[3]));
  const double size = (area.max[0] - area.min[0]) * (area.max[1] - area.min[1]);
  const std::uint64_t points = std::max<std::uint64_t>(point_count(store, level), 1);
  return rounded_to_two_digits(std::sqrt(size / static_cast<double>(points)));
}

std::uint32_t cell_count(double cells) {
  if (!(cells <= kMaxGridCells)) {
    throw UsageError(
        stream::message("{cell} is too small: a side of the raster would have {} cells",
                        plain_number(std::ceil(cells))));
  }
  return static_cast<std::uint32_t>(std::max(1.0, cells));
}

/// The cells that cover a range; their borders are multiples of the cell size.
struct CellRange {
  CellRange(double low, double high, double cell)
      : first(std::floor(low / cell + kRounding)), last(std::ceil(high / cell - kRounding)) {}

  [[nodiscard]] std::uint32_t count() const { return cell_count(last - first); }

  /// Tolerance, as a share of a cell, for a range to end at a multiple.
  static constexpr double kRounding = 1e-6;
  double first, last;  ///< as multiples of the cell
};

}  // namespace

RasterGrid aligned_grid(const stream::Store& store, RasterRequest& request,
                        const Context& context) {
  if (request.cell)
    throw UsageError(stream::message("{align} sets the cell size: leave {cell} out"));
  need_level(store, request.sampler.level);
  stream::SourceOptions options;
  options.stop = context.stop;
  const stream::SourceInfo info =
      stream::open_source(std::span(&request.align, 1), options)->info();

  const std::array<double, 6>& world = info.world.xy;
  if (!info.grid) {
    throw stream::Error(request.align, "is not a raster, so there is no grid to align with")
        .remedy(stream::message("pass a raster to {align}"));
  }
  if (world[1] != 0 || world[3] != 0) {
    throw stream::Error(request.align, "is rotated, which the output does not support")
        .remedy("align with a raster that is north up");
  }
  const std::optional<CoordinateSystem> grid_crs = crs_of_source(info).system;
  const std::optional<CoordinateSystem> store_crs =
      CoordinateSystem::of(store.schema().crs, store.path().string());
  if (grid_crs && store_crs && !grid_crs->same_places(*store_crs)) {
    if (request.to && !request.to->to().same_places(*grid_crs)) {
      throw UsageError(stream::message("{align} sets the CRS to that of {}, {}: leave {to_crs} out",
                                       request.align, grid_crs->title()));
    }
    if (!request.to) {
      request.to.emplace(system_of(store), *grid_crs);
      if (!request.to->note().empty()) context.say(request.to->note());
    }
  } else if (request.to) {
    throw UsageError(
        grid_crs ? stream::message("{align} sets the CRS to that of {}: leave {to_crs} out",
                                   request.align)
                 : stream::message("the CRS of {} is unknown, so {align} uses the store's: leave "
                                   "{to_crs} out",
                                   request.align));
  } else if (grid_crs.has_value() != store_crs.has_value()) {
    context.say(fmt::format(
        "{}: assuming that its grid is in the store's CRS, because the CRS of the {} is unknown",
        request.align, grid_crs ? "store" : "file"));
  }
  return {.x = world[2],
          .y = world[5],
          .step_x = world[0],
          .step_y = world[4],
          .columns = cell_count(static_cast<double>(info.columns)),
          .rows = cell_count(static_cast<double>(info.rows))};
}

RasterGrid raster_grid(const stream::Store& store, const RasterRequest& request) {
  need_level(store, request.sampler.level);
  const unsigned level =
      Detail{.level = request.sampler.level, .focuses = request.sampler.focuses}.finest();
  const auto within_region = [&](stream::Box3 box) {
    if (request.region) {
      const stream::Box3& limits = request.region->extent();
      for (std::size_t axis = 0; axis < 2; ++axis) {
        box.min[axis] = std::max(box.min[axis], limits.min[axis]);
        box.max[axis] = std::min(box.max[axis], limits.max[axis]);
      }
    }
    return box;
  };
  const stream::Box3 selected = area_of(store);
  const stream::Box3 overlap = within_region(selected);
  if (store.points() == 0 ||
      !(overlap.min[0] <= overlap.max[0] && overlap.min[1] <= overlap.max[1])) {
    throw_none_inside(store);
  }
  // With a given cell size, a condition does not change the grid.
  stream::Box3 box = request.cell ? within_region(area_of(store.whole())) : overlap;
  const std::array<double, 6>& world = store.schema().world.xy;
  const bool straight = world[1] == 0 && world[3] == 0;
  RasterGrid grid;
  if (!request.cell && !request.to && store.schema().grid && straight && level == 0) {
    // Use the lattice itself: the samples within the box.
    std::array<double, 2> first{}, last{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double step = world[4 * axis], origin = axis == 0 ? world[2] : world[5];
      const double size =
          static_cast<double>(axis == 0 ? store.schema().columns : store.schema().rows);
      double a = (box.min[axis] - origin) / step, b = (box.max[axis] - origin) / step;
      if (a > b) std::swap(a, b);
      first[axis] = std::max(0.0, std::ceil(a - CellRange::kRounding));
      last[axis] = std::min(size - 1, std::floor(b + CellRange::kRounding));
      if (first[axis] > last[axis]) throw_none_inside(store);
    }
    grid.step_x = world[0];
    grid.step_y = world[4];
    grid.x = world[2] + world[0] * first[0];
    grid.y = world[5] + world[4] * first[1];
    grid.columns = cell_count(last[0] - first[0] + 1);
    grid.rows = cell_count(last[1] - first[1] + 1);
    return grid;
  }
  double cell = request.cell.value_or(spacing_of(store, selected, level));
  if (request.to) {
    const Point2 centre{0.5 * (box.min[0] + box.max[0]), 0.5 * (box.min[1] + box.max[1])};
    // Measure in both directions, because the new CRS may be discontinuous on one side.
    std::vector<Point2> steps{centre,
                              {centre[0] + cell, centre[1]},
                              {centre[0], centre[1] + cell},
                              {centre[0] - cell, centre[1]},
                              {centre[0], centre[1] - cell}};
    box = converted_box(box, *request.to, store);
    if (!request.cell) {
      request.to->forward(steps);
      const auto distance_to = [&](std::size_t i) {
        return base::hypot(steps[i][0] - steps[0][0], steps[i][1] - steps[0][1]);
      };
      // A much larger distance crosses a discontinuity.
      const auto cell_length = [&](std::size_t i) {
        const double forward = distance_to(i), backward = distance_to(i + 2);
        return backward < 0.5 * forward ? backward : forward;
      };
      cell = std::sqrt(cell_length(1) * cell_length(2));
    }
  }
  if (!(cell > 0) || !std::isfinite(cell)) {
    throw stream::Error(
        store.path().string(),
        "the points are all at one position or on one line, so a cell size cannot be "
        "derived")
        .remedy(stream::message("pass {cell}"));
  }
  grid.step_x = cell;
  grid.step_y = -cell;
  if (!request.cell) {
    grid.x = box.min[0] + 0.5 * cell;
    grid.y = box.max[1] - 0.5 * cell;
    grid.columns = cell_count(std::ceil((box.max[0] - box.min[0]) / cell - CellRange::kRounding));
    grid.rows = cell_count(std::ceil((box.max[1] - box.min[1]) / cell - CellRange::kRounding));
    return grid;
  }
  const CellRange columns(box.min[0], box.max[0], cell), rows(box.min[1], box.max[1], cell);
  const DecimalMultiples multiple(cell);
  grid.x = multiple(columns.first + 0.5);
  grid.y = multiple(rows.last - 0.5);
  grid.columns = columns.count();
  grid.rows = rows.count();
  return grid;
}

}  // namespace terrace::terrain
