// SPDX-License-Identifier: Apache-2.0
#include "build/common_frame.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>

#include "base/stored_entities.hpp"
#include "base/units.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {
namespace {

/// A lattice is the same if its corners differ by at most this part of a step.
constexpr double kSamePlace = 1e-3;

std::string description_of(const stream::Channel& channel) {
  return fmt::format("{} ({}, scale {}, offset {}, unit \"{}\")", channel.name,
                     stream::name_of(channel.type), number_text(channel.scale),
                     number_text(channel.offset), channel.unit);
}

void check_parameters(const FramedPoints& a, const FramedPoints& b) {
  const auto without_seed = [](const FramedPoints& points) {
    auto parameters = points.schema.parameters;
    std::erase_if(parameters, [](const auto& parameter) { return parameter.first == "seed"; });
    return parameters;
  };
  const auto first = without_seed(a), second = without_seed(b);
  const auto [x, y] = std::mismatch(first.begin(), first.end(), second.begin(), second.end());
  if (x == first.end() && y == second.end()) return;
  const auto text = [](const auto& at, const auto& end) {
    return at == end ? std::string("nothing more") : fmt::format("{} {}", at->first, at->second);
  };
  throw misfit(a.name, b.name,
               fmt::format("it was clustered with {}, the other with {}", text(y, second.end()),
                           text(x, first.end())))
      .remedy("build it again with the same options");
}

/// Throws: stream::Error unless the points of both have the same meaning.
void check_schemas(const FramedPoints& a, const FramedPoints& b) {
  const stream::StoreSchema &first = a.schema, &second = b.schema;
  if (first.grid != second.grid) {
    throw misfit(
        a.name, b.name,
        second.grid ? "it is a raster, the other is not" : "it is not a raster, the other is");
  }
  if (!same_crs(first.crs, second.crs)) {
    throw misfit(
        a.name, b.name,
        fmt::format("the CRS is {}, not {}", second.crs.name.empty() ? "unknown" : second.crs.name,
                    first.crs.name.empty() ? "unknown" : first.crs.name))
        .remedy(stream::message("build it again with {crs}, or convert its source"));
  }
  if (first.vertical != second.vertical) {
    const auto named = [](const std::string& heights) {
      return heights.empty() ? "unknown" : heights;
    };
    throw misfit(
        a.name, b.name,
        fmt::format("its heights are {}, not {}", named(second.vertical), named(first.vertical)))
        .remedy(stream::message("build it again with {vertical}"));
  }
  const auto [x, y] = std::mismatch(first.attributes.begin(), first.attributes.end(),
                                    second.attributes.begin(), second.attributes.end());
  if (x != first.attributes.end() || y != second.attributes.end()) {
    const auto text = [](const auto& at, const auto& end) {
      return at == end ? std::string("no more attributes") : description_of(*at);
    };
    throw misfit(a.name, b.name,
                 fmt::format("it has {}, the other {}", text(y, second.attributes.end()),
                             text(x, first.attributes.end())))
        .remedy(stream::message("build both with the same {keep} or {drop}"));
  }
  check_parameters(a, b);
}

/// Whether the stored coordinates have the same steps, wherever they are.
bool same_steps(const stream::Placement& a, const stream::Placement& b) {
  const std::array<double, 6>&x = a.world.xy, &y = b.world.xy;
  return x[0] == y[0] && x[1] == y[1] && x[3] == y[3] && x[4] == y[4];
}

stream::Box3 shifted_bounds(stream::Box3 box, const std::array<std::int64_t, 3>& shift) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.min[axis] += static_cast<double>(shift[axis]);
    box.max[axis] += static_cast<double>(shift[axis]);
  }
  return box;
}

/// Whether coordinates of 32 bits still have 32 bits.
bool stays_in_type(const stream::Box3& box, const stream::StoreSchema& schema) {
  constexpr double kMost = 2147483647;
  for (std::size_t axis = schema.grid ? 2 : 0; axis < 3; ++axis) {
    if (schema.coordinates[axis].type != stream::ScalarType::i32) continue;
    if (!(box.min[axis] >= -kMost && box.max[axis] <= kMost)) return false;
  }
  return true;
}

/// Returns the shift from the stored coordinates of some points to those of others. Throws:
/// stream::Error if there is none.
std::array<std::int64_t, 3> shift_between(const FramedPoints& from, const FramedPoints& to) {
  const stream::StoreSchema &source = from.schema, &target = to.schema;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const stream::Channel &a = source.coordinates[axis], &b = target.coordinates[axis];
    if (a.type != b.type || a.unit != b.unit) {
      throw misfit(
          to.name, from.name,
          fmt::format("its coordinates are {}, not {}", description_of(a), description_of(b)))
          .remedy("build the sources together");
    }
  }
  stream::Box3 bounds = from.bounds;
  if (bounds.empty()) bounds = {{0, 0, 0}, {0, 0, 0}};
  const stream::Point3 middle{std::floor(0.5 * bounds.min[0] + 0.5 * bounds.max[0]),
                              std::floor(0.5 * bounds.min[1] + 0.5 * bounds.max[1]), 0};
  const stream::Point3 place = world_point(source, middle);
  const auto stored = stored_place(target, {place[0], place[1]});
  const stream::Channel &height = source.coordinates[2], &target_height = target.coordinates[2];
  const std::array<double, 3> exact{stored[0] - middle[0], stored[1] - middle[1],
                                    (height.offset - target_height.offset) / target_height.scale};
  std::array<std::int64_t, 3> shift{};
  bool fits = height.scale == target_height.scale;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool is_integer =
        (source.grid && axis < 2) || (source.coordinates[axis].type != stream::ScalarType::f32 &&
                                      source.coordinates[axis].type != stream::ScalarType::f64);
    constexpr double kMost = 0x1p50;
    const double whole = std::round(exact[axis]);
    // Numbers with a fraction stay as they are.
    const bool is_same =
        axis == 2 ? height.offset == target_height.offset : source.world.xy == target.world.xy;
    fits = fits && std::abs(whole) <= kMost && (is_integer || (is_same && whole == 0));
    if (fits) shift[axis] = static_cast<std::int64_t>(whole);
  }
  // Compares places at the corners of the bounds, in steps of the target.
  for (unsigned corner = 0; corner < 4 && fits; ++corner) {
    const stream::Point3 p{(corner & 1 ? bounds.max : bounds.min)[0],
                           (corner & 2 ? bounds.max : bounds.min)[1], 0};
    const stream::Point3 at = world_point(source, p);
    const auto in_target = stored_place(target, {at[0], at[1]});
    for (std::size_t axis = 0; axis < 2; ++axis) {
      fits = fits &&
             std::abs(in_target[axis] - p[axis] - static_cast<double>(shift[axis])) <= kSamePlace;
    }
  }
  if (from.bounds.empty()) fits = fits && same_steps(source, target);
  fits = fits && stays_in_type(shifted_bounds(bounds, shift), target);
  fits = fits && std::abs(exact[2] - static_cast<double>(shift[2])) <= kSamePlace;
  const bool is_shifted = shift != std::array<std::int64_t, 3>{};
  if (fits && is_shifted && entities_of(source) != stream::Entities::points) {
    throw misfit(to.name, from.name,
                 "the offsets of their coordinates differ, and corners cannot be shifted")
        .remedy("build the sources together");
  }
  if (fits) return shift;
  throw misfit(to.name, from.name,
               source.grid
                   ? "their cells do not line up"
                   : "the scales or offsets of their coordinates differ, not by whole steps")
      .remedy(source.grid ? "resample one of the sources, or build them together"
                          : "build the sources together");
}

/// Adds the columns and rows of all rasters, so that those of the whole begin at 0.
void place_rasters(std::span<const FramedPoints> points, CommonFrame& frame) {
  std::array<std::int64_t, 2> low{}, high{};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::array<std::uint64_t, 2> cells{points[i].schema.columns, points[i].schema.rows};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const std::int64_t begin = frame.shifts[i][axis];
      low[axis] = std::min(low[axis], begin);
      high[axis] = std::max(high[axis], begin + static_cast<std::int64_t>(cells[axis]));
    }
  }
  for (std::array<std::int64_t, 3>& shift : frame.shifts) {
    for (std::size_t axis = 0; axis < 2; ++axis) shift[axis] -= low[axis];
  }
  constexpr std::int64_t kMostCells = std::int64_t{1} << 31;
  if (high[0] - low[0] > kMostCells || high[1] - low[1] > kMostCells) {
    throw stream::Error(points.back().name,
                        fmt::format("together with {} the raster would have {} x {} cells",
                                    points.front().name, high[0] - low[0], high[1] - low[1]))
        .remedy("join rasters that are nearer to each other");
  }
  frame.schema.columns = static_cast<std::uint64_t>(high[0] - low[0]);
  frame.schema.rows = static_cast<std::uint64_t>(high[1] - low[1]);
  std::array<double, 6>& xy = frame.schema.world.xy;
  const auto column = static_cast<double>(low[0]), row = static_cast<double>(low[1]);
  xy[2] += xy[0] * column + xy[1] * row;
  xy[5] += xy[3] * column + xy[4] * row;
}

}  // namespace

stream::Error misfit(const std::string& first, const std::string& second,
                     const std::string& cause) {
  return stream::Error(second, fmt::format("does not fit {}: {}", first, cause));
}

FramedPoints framed_points(const stream::Store& store) {
  return {store.schema(), store.bounds(), store.path().string()};
}

CommonFrame common_frame(std::span<const FramedPoints> points) {
  CommonFrame frame{points.front().schema, {}};
  frame.schema.nodata = 0;
  std::vector<std::string> formats;
  for (const FramedPoints& each : points) {
    check_schemas(points.front(), each);
    frame.shifts.push_back(shift_between(each, points.front()));
    frame.schema.nodata += each.schema.nodata;
    if (std::find(formats.begin(), formats.end(), each.schema.format) == formats.end()) {
      formats.push_back(each.schema.format);
    }
  }
  std::sort(formats.begin(), formats.end());
  frame.schema.format.clear();
  for (const std::string& format : formats) {
    frame.schema.format += (frame.schema.format.empty() ? "" : ", ") + format;
  }
  if (frame.schema.grid) place_rasters(points, frame);
  return frame;
}

}  // namespace terrace::terrain
