// SPDX-License-Identifier: Apache-2.0
#include "format/common_placement.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace terrace::stream {
namespace {

/// Relative tolerance of a ratio of scales: less than a ten-thousandth of a step over 32 bits.
constexpr double kSameRatio = 1e-14;
constexpr double kSameStep = 1e-4;
/// Upper limit of the parts that a step is divided into.
constexpr std::uint64_t kMaxParts = 10'000;

bool is_whole(double steps) { return std::abs(steps - std::round(steps)) <= kSameStep; }

/// Returns the smallest number of parts for which near(steps * parts) holds; nullopt beyond
/// kMaxParts.
template <class Near>
std::optional<std::uint64_t> parts_of(double steps, const Near& near) {
  for (std::uint64_t parts = 1; parts <= kMaxParts; ++parts) {
    if (near(steps * static_cast<double>(parts))) return parts;
  }
  return std::nullopt;
}

/// One axis of a lattice: values k * scale + offset for integers k.
struct Axis {
  double scale = 1, offset = 0;
};

/// Returns the number of parts into which to divide the first scale so that the values of all axes
/// are multiples of the result, counted from the first offset. Returns nullopt if it is more than
/// kMaxParts.
std::optional<std::uint64_t> common_parts(std::span<const Axis> axes) {
  const Axis& first = axes.front();
  std::uint64_t parts = 1;
  const auto divide = [&](std::optional<std::uint64_t> factor) {
    if (factor) parts *= *factor;
    return factor && parts <= kMaxParts;
  };
  for (const Axis& axis : axes) {
    const auto step = [&] { return first.scale / static_cast<double>(parts); };
    if (!divide(parts_of(axis.scale / step(), [](double ratio) {
          return ratio >= 0.5 && std::abs(ratio - std::round(ratio)) <= kSameRatio * ratio;
        }))) {
      return std::nullopt;
    }
    if (!divide(parts_of((axis.offset - first.offset) / step(), is_whole))) return std::nullopt;
  }
  return parts;
}

/// Returns the first axis with its scale divided into parts. The quotient is rounded, so an equal
/// scale of another axis is used in its place.
Axis divided_axis(std::span<const Axis> axes, std::uint64_t parts) {
  Axis divided = axes.front();
  divided.scale /= static_cast<double>(parts);
  for (const Axis& axis : axes) {
    if (std::abs(axis.scale / divided.scale - 1) <= kSameRatio) return {axis.scale, divided.offset};
  }
  return divided;
}

/// Moves the offset by whole steps, if necessary, so that 32 bits cover `low` to `high`. Returns
/// false if they cannot.
bool reach(double low, double high, Axis& axis) {
  constexpr double kMax = std::numeric_limits<std::int32_t>::max();
  const auto reaches = [&] {
    return (low - axis.offset) / axis.scale >= -kMax && (high - axis.offset) / axis.scale <= kMax;
  };
  if (!(low <= high) || reaches()) return true;
  axis.offset += std::round((0.5 * low + 0.5 * high - axis.offset) / axis.scale) * axis.scale;
  return reaches();
}

std::optional<Lattice> common_lattice(std::span<const Lattice> lattices, const Box3& bounds) {
  std::array<std::vector<Axis>, 3> axes;
  std::array<std::uint64_t, 3> parts{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (const Lattice& lattice : lattices)
      axes[i].push_back({lattice.scale[i], lattice.offset[i]});
    const std::optional<std::uint64_t> axis_parts = common_parts(axes[i]);
    if (!axis_parts) return std::nullopt;
    parts[i] = *axis_parts;
  }
  // Equal steps in x and y stay equal, because triangulations are Delaunay in units of steps.
  if (lattices.front().scale[0] == lattices.front().scale[1]) {
    parts[0] = parts[1] = std::lcm(parts[0], parts[1]);
  }
  Lattice common;
  for (std::size_t i = 0; i < 3; ++i) {
    Axis axis = divided_axis(axes[i], parts[i]);
    if (!reach(bounds.min[i], bounds.max[i], axis)) return std::nullopt;
    common.scale[i] = axis.scale;
    common.offset[i] = axis.offset;
  }
  return common;
}

/// Returns the lattice of int32 coordinates, which can be moved; nullopt for other types.
std::optional<Lattice> movable_lattice(const Placement& placement) {
  for (const Channel& coordinate : placement.coordinates) {
    if (coordinate.type != ScalarType::i32) return std::nullopt;
  }
  return lattice_of(placement);
}

void place(const Lattice& lattice, Placement& placement) {
  placement.world.xy = {lattice.scale[0], 0, lattice.offset[0], 0, lattice.scale[1],
                        lattice.offset[1]};
  placement.coordinates[2].scale = lattice.scale[2];
  placement.coordinates[2].offset = lattice.offset[2];
}

}  // namespace

Placement common_placement(std::span<const Placement> placements, const Box3& bounds) {
  const Placement& first = placements.front();
  const auto is_first = [&](const Placement& placement) {
    return placement.world == first.world && placement.coordinates == first.coordinates;
  };
  if (std::all_of(placements.begin(), placements.end(), is_first)) return first;
  Placement common = first;
  std::vector<Lattice> lattices;
  for (const Placement& placement : placements) {
    if (const auto lattice = movable_lattice(placement)) lattices.push_back(*lattice);
  }
  if (lattices.size() == placements.size()) {
    if (const auto lattice = common_lattice(lattices, bounds)) {
      place(*lattice, common);
      return common;
    }
  }
  for (Channel& coordinate : common.coordinates) coordinate.type = ScalarType::f64;
  place({}, common);
  return common;
}

Move move_between(const Placement& from, const Placement& to) {
  const auto axes_of = [](const Placement& placement) {
    const auto& [world, coordinates, crs] = placement;
    return std::array<Axis, 3>{Axis{world.xy[0], world.xy[2]}, Axis{world.xy[4], world.xy[5]},
                               Axis{coordinates[2].scale, coordinates[2].offset}};
  };
  const std::array<Axis, 3> a = axes_of(from), b = axes_of(to);
  const bool in_steps = to.coordinates[0].type != ScalarType::f64;
  Move move;
  for (std::size_t i = 0; i < 3; ++i) {
    move.factor[i] = a[i].scale / b[i].scale;
    move.shift[i] = (a[i].offset - b[i].offset) / b[i].scale;
    if (!in_steps) continue;
    const double factor = std::round(move.factor[i]), shift = std::round(move.shift[i]);
    if (!(std::abs(move.factor[i] - factor) <= kSameRatio * factor) || !is_whole(move.shift[i])) {
      throw std::domain_error(std::string("its ") + "xyz"[i]);
    }
    move.factor[i] = factor;
    move.shift[i] = shift;
  }
  return move;
}

}  // namespace terrace::stream
