// SPDX-License-Identifier: Apache-2.0
#include "format/las/layout.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>

#include <fmt/core.h>

#include "io/bytes.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kMaxRecordBytes = 65535, kMaxVlrBytes = 65535;
constexpr std::size_t kExtraNameBytes = 32;

bool has(std::span<const Channel> attributes, std::string_view name) {
  return std::any_of(attributes.begin(), attributes.end(),
                     [name](const Channel& channel) { return channel.name == name; });
}

unsigned point_format_of(std::span<const Channel> attributes, LasFormats formats) {
  const bool colour = has(attributes, "red") && has(attributes, "green") && has(attributes, "blue");
  const bool newer = has(attributes, "scan_angle") || has(attributes, "overlap") ||
                     has(attributes, "scanner_channel") || has(attributes, "nir");
  if (formats == LasFormats::all && has(attributes, "scan_angle_rank") && !newer) {
    return (has(attributes, "gps_time") ? 1U : 0U) + (colour ? 2U : 0U);
  }
  return !colour ? 6 : has(attributes, "nir") ? 8 : 7;
}

/// Returns the number of a type in the specification's table of extra bytes.
char extra_type(ScalarType type) {
  constexpr std::array<char, 10> kNumbers{2, 1, 4, 3, 6, 5, 8, 7, 9, 10};
  return kNumbers[static_cast<std::size_t>(type)];
}

void describe(const Channel& channel, std::string& descriptions) {
  std::string row(kLasExtraBytesDescription, '\0');
  row[2] = extra_type(channel.type);
  std::copy_n(channel.name.begin(), std::min(channel.name.size(), kExtraNameBytes),
              row.begin() + 4);
  const auto put = [&row](std::size_t at, double value) {
    std::string bytes;
    append_little_endian(bytes, value);
    row.replace(at, bytes.size(), bytes);
  };
  if (channel.scale != 1.0 || channel.offset != 0.0) {
    row[3] = 8 + 16;
    put(112, channel.scale);
    put(136, channel.offset);
  }
  descriptions += row;
}

constexpr int kMaxDecimals = 9;
constexpr std::array<double, kMaxDecimals + 1> kPowers{1e0, 1e1, 1e2, 1e3, 1e4,
                                                       1e5, 1e6, 1e7, 1e8, 1e9};
/// One step less than the range of 32 bits, so that rounding stays within it.
constexpr double kReach = std::numeric_limits<std::int32_t>::max() - 1.0;

/// Returns the fewest decimals, at least `decimals`, that reproduce every coordinate of the axis.
int decimals_of(std::span<const Point3> points, std::size_t axis, int decimals) {
  for (const Point3& p : points) {
    while (decimals < kMaxDecimals &&
           std::nearbyint(p[axis] * kPowers[static_cast<std::size_t>(decimals)]) /
                   kPowers[static_cast<std::size_t>(decimals)] !=
               p[axis]) {
      ++decimals;
    }
  }
  return decimals;
}

}  // namespace

LasLayout las_layout(std::span<const Channel> attributes, const std::string& file,
                     LasFormats formats) {
  LasLayout layout{.point_format = point_format_of(attributes, formats)};
  layout.record_bytes = las_record_bytes(layout.point_format);
  std::vector<LasField> standard = las_fields(layout.point_format);
  std::vector<std::string> names;
  for (const LasField& field : standard) names.push_back(field.channel.name);
  for (const Channel& channel : attributes) {
    const bool is_angle = formats == LasFormats::newer && channel.name == "scan_angle_rank" &&
                          !has(attributes, "scan_angle");
    const std::string_view field_name = is_angle ? std::string_view("scan_angle") : channel.name;
    const auto field = std::find_if(standard.begin(), standard.end(), [&](const LasField& each) {
      return each.channel.name == field_name;
    });
    if (field != standard.end()) {
      layout.fields.push_back(*field);
      standard.erase(field);  // a second attribute with this name goes to extra bytes
      continue;
    }
    LasField extra{.channel = channel, .offset = layout.record_bytes};
    // If a name has the maximal length, its end is replaced by the number that makes it distinct.
    std::string name = channel.name.empty() ? "extra" : channel.name.substr(0, kExtraNameBytes);
    for (int n = 2; std::find(names.begin(), names.end(), name) != names.end(); ++n) {
      const std::string number = fmt::format("_{}", n);
      name = channel.name.substr(0, kExtraNameBytes - number.size()) + number;
    }
    names.push_back(name);
    extra.channel.name = name;
    layout.record_bytes += size_of(channel.type);
    describe(extra.channel, layout.extra_bytes);
    layout.fields.push_back(std::move(extra));
  }
  if (layout.record_bytes > kMaxRecordBytes || layout.extra_bytes.size() > kMaxVlrBytes) {
    throw Error(file, counted(attributes.size(), "attribute") + " are more than LAS has room for")
        .remedy("write PLY");
  }
  return layout;
}

Lattice decimal_lattice(std::span<const Point3> points, const std::optional<Box3>& bounds,
                        bool degrees) {
  Box3 box;
  for (const Point3& p : points) box.include(p);
  if (bounds) box.include(*bounds);
  Lattice lattice;
  if (box.empty()) return lattice;
  std::array<double, 3> half{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lattice.offset[axis] = std::nearbyint(0.5 * box.min[axis] + 0.5 * box.max[axis]);
    half[axis] = 0.5 * box.max[axis] - 0.5 * box.min[axis];
  }
  half[0] = half[1] = std::max(half[0], half[1]);
  const int planar = decimals_of(points, 1, decimals_of(points, 0, 0));
  const std::array<int, 3> needed_decimals{planar, planar, decimals_of(points, 2, 0)};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int usual = degrees && axis < 2 ? 7 : 3;
    int decimals = std::max(needed_decimals[axis], usual);
    const auto reach = [&] {  // measured from the offset, which is rounded to a whole number
      return half[axis] * (bounds ? 1 : decimals > usual ? 1000 : 20) + 1;
    };
    while (decimals > 0 && reach() * kPowers[static_cast<std::size_t>(decimals)] > kReach) {
      --decimals;
    }
    double step = 1 / kPowers[static_cast<std::size_t>(decimals)];
    while (reach() / step > kReach) step *= 10;
    lattice.scale[axis] = step;
  }
  return lattice;
}

}  // namespace terrace::stream
