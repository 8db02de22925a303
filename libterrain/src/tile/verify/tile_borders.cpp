// SPDX-License-Identifier: Apache-2.0
#include "tile/verify/tile_borders.hpp"

#include <algorithm>
#include <cmath>

#include <terrace/stream/error.hpp>
#include <terrace/stream/gzip.hpp>

#include "base/units.hpp"

namespace terrace::terrain {
namespace {

/// What a tile may unpack to.
constexpr std::uint64_t kMostBorderBytes = std::uint64_t{1} << 28;
/// Metres by which neighbours' heights may differ.
constexpr double kBorderSlack = 1e-3;

}  // namespace

TileBorders borders_of(const TileMesh& mesh) {
  const TileEdges edges = edges_of(mesh);
  const auto take = [&](const std::vector<std::uint32_t>& list,
                        const std::vector<std::uint16_t>& along) {
    BorderSide side;
    for (const std::uint32_t vertex : list) side.emplace_back(along[vertex], mesh.metres(vertex));
    return side;
  };
  return {take(edges.west, mesh.v), take(edges.south, mesh.u), take(edges.east, mesh.v),
          take(edges.north, mesh.u)};
}

std::string misfit(const BorderSide& a, const BorderSide& b) {
  const bool same_places = a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(),
                                                              [](const auto& p, const auto& q) {
                                                                return p.first == q.first;
                                                              });
  if (!same_places) return "vertices at other places";
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, std::abs(a[i].second - b[i].second));
  }
  return most > kBorderSlack ? "heights that differ by up to " + readable_number(most) + " m" : "";
}

DecodedTile unpack_tile(const std::vector<std::byte>& bytes, const std::string& name) {
  if (!stream::is_gzip(bytes)) return decode_tile(bytes, name);
  try {
    return decode_tile(stream::gunzip(bytes, kMostBorderBytes, name), name);
  } catch (const stream::Error& packed) {
    // One plain tile of 65536 begins as gzip does.
    try {
      return decode_tile(bytes, name);
    } catch (const stream::Error&) {
      throw packed;
    }
  }
}

}  // namespace terrace::terrain
