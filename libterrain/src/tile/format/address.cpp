// SPDX-License-Identifier: Apache-2.0
#include "tile/format/address.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include <fmt/core.h>

#include "base/units.hpp"
#include "tile/format/ellipsoid.hpp"

namespace terrace::terrain {
namespace {

// Returns the last tile along an axis that begins before `place` (in tiles from the first).
std::uint32_t clamp_index(double place, std::uint32_t count) {
  return static_cast<std::uint32_t>(std::clamp(place, 0.0, static_cast<double>(count - 1)));
}

// Returns the first and last index of the tiles between two places on an axis.
std::pair<std::uint32_t, std::uint32_t> span_of(double from, double to, std::uint32_t count) {
  const double first = std::floor(from);
  const double last = std::max(first, std::ceil(to) - 1.0);
  return {clamp_index(first, count), clamp_index(last, count)};
}

std::optional<std::uint32_t> take_number(std::string_view& text, char end) {
  const std::size_t stop = text.find(end);
  if (stop == std::string_view::npos || stop == 0 || (stop > 1 && text[0] == '0')) return {};
  const auto value = number_from<std::uint32_t>(text.substr(0, stop));
  text.remove_prefix(stop + 1);
  return value;
}

}  // namespace

std::string tile_path(const TileAddress& tile) {
  return fmt::format("{}/{}/{}.terrain", tile.zoom, tile.x, tile.y);
}

std::optional<TileAddress> parse_tile_path(const std::string& path) {
  std::string_view rest = path;
  const auto zoom = take_number(rest, '/');
  const auto x = take_number(rest, '/');
  const auto y = take_number(rest, '.');
  if (!zoom || !x || !y || rest != "terrain" || *zoom > kDeepestZoom) return {};
  if (*x >= tile_columns(*zoom) || *y >= tile_rows(*zoom)) return {};
  return TileAddress{*zoom, *x, *y};
}

GeographicBox box_of(const TileAddress& tile) {
  // 180 / 2^zoom has few bits, so products with the index are exact, and the borders shared by
  // neighbours are the same numbers at every zoom.
  const double width = 180.0 / static_cast<double>(tile_rows(tile.zoom));
  return {.west = -180.0 + width * tile.x,
          .south = -90.0 + width * tile.y,
          .east = -180.0 + width * (tile.x + 1.0),
          .north = -90.0 + width * (tile.y + 1.0)};
}

TileRange tiles_in(const GeographicBox& box, unsigned zoom) {
  const double width = 180.0 / static_cast<double>(tile_rows(zoom));
  const auto [x0, x1] =
      span_of((box.west + 180.0) / width, (box.east + 180.0) / width, tile_columns(zoom));
  const auto [y0, y1] =
      span_of((box.south + 90.0) / width, (box.north + 90.0) / width, tile_rows(zoom));
  return {x0, y0, x1, y1};
}

double expected_error(unsigned zoom) {
  return kEquatorialRadius * 2.0 * std::numbers::pi * 0.25 / (65.0 * 2.0) /
         std::ldexp(1.0, static_cast<int>(zoom));
}

}  // namespace terrace::terrain
