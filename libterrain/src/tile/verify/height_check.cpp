// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include <terrace/tri/point_tin.hpp>

#include "tile/make/sample_parts.hpp"
#include "tile/verify/checks.hpp"

namespace terrace::terrain {
namespace {

/// Measures the parts of one tile. Each part gets the triangles that may be over it.
class Measurement {
 public:
  Measurement(const TileAddress& address, const TileMesh& mesh, TileSurface& surface)
      : mesh_(mesh), surface_(surface), tile_box_(box_of(address)), number_(mesh.size(), kNone) {
    units_ = kTileUnits / (tile_box_.east - tile_box_.west);
  }

  void part(const GeographicBox& box, const std::vector<std::uint32_t>& triangles);

  TileHeights result;

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  [[nodiscard]] bool over(std::uint32_t triangle, const GeographicBox& box) const;
  void measure(const GeographicBox& box, const std::vector<std::uint32_t>& triangles);
  /// Converts to units of the tile. Clamps, because rounding must not move a sample out of it.
  [[nodiscard]] double unit(double degrees, double from) const {
    return std::clamp((degrees - from) * units_, 0.0, static_cast<double>(kTileUnits));
  }

  const TileMesh& mesh_;
  TileSurface& surface_;
  GeographicBox tile_box_;
  double units_ = 0.0;
  std::vector<std::uint32_t> number_;  ///< numbers of vertices in a part
  SurfaceSamples samples_;
};

bool Measurement::over(std::uint32_t triangle, const GeographicBox& box) const {
  const auto& t = mesh_.triangles[triangle];
  const auto meets = [&](const std::vector<std::uint16_t>& c, double from, double to) {
    const auto [low, high] = std::minmax({c[t[0]], c[t[1]], c[t[2]]});
    // A unit more, to allow for rounding.
    return low - 1 <= to && high + 1 >= from;
  };
  return meets(mesh_.u, (box.west - tile_box_.west) * units_,
               (box.east - tile_box_.west) * units_) &&
         meets(mesh_.v, (box.south - tile_box_.south) * units_,
               (box.north - tile_box_.south) * units_);
}

void Measurement::part(const GeographicBox& box, const std::vector<std::uint32_t>& triangles) {
  if (!may_have_samples(box, surface_)) return;
  std::vector<std::uint32_t> here;
  for (const std::uint32_t t : triangles) {
    if (over(t, box)) here.push_back(t);
  }
  if (!is_to_be_cut(box, surface_)) {
    measure(box, here);
    return;
  }
  for (const GeographicBox& quarter : quarters_of(box)) part(quarter, here);
}

void Measurement::measure(const GeographicBox& box, const std::vector<std::uint32_t>& triangles) {
  surface_.samples(box, samples_);
  std::vector<double> u, v, height;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    // Where parts meet, each sample counts once.
    const bool elsewhere = (samples_.longitude[i] == box.east && box.east != tile_box_.east) ||
                           (samples_.latitude[i] == box.north && box.north != tile_box_.north);
    if (elsewhere) continue;
    u.push_back(unit(samples_.longitude[i], tile_box_.west));
    v.push_back(unit(samples_.latitude[i], tile_box_.south));
    height.push_back(samples_.height[i]);
    index.push_back(i);
  }
  if (u.empty()) return;
  std::vector<tri::Point3> vertices;
  std::vector<std::array<std::uint32_t, 3>> local;
  std::vector<std::uint32_t> touched;
  for (const std::uint32_t t : triangles) {
    std::array<std::uint32_t, 3> corners{};
    for (unsigned k = 0; k < 3; ++k) {
      const std::uint32_t vertex = mesh_.triangles[t][k];
      if (number_[vertex] == kNone) {
        number_[vertex] = static_cast<std::uint32_t>(vertices.size());
        touched.push_back(vertex);
        vertices.push_back({static_cast<double>(mesh_.u[vertex]),
                            static_cast<double>(mesh_.v[vertex]), mesh_.metres(vertex)});
      }
      corners[k] = number_[vertex];
    }
    local.push_back(corners);
  }
  for (const std::uint32_t vertex : touched) number_[vertex] = kNone;
  const tri::TinErrors errors = tri::measure_surface(u, v, height, vertices, local);
  result.samples += u.size();
  result.uncovered += errors.uncovered;
  if (errors.covered > 0 && errors.largest > result.max_error) {
    result.max_error = errors.largest;
    result.longitude = samples_.longitude[index[errors.largest_at]];
    result.latitude = samples_.latitude[index[errors.largest_at]];
  }
}

}  // namespace

void TileHeights::add(const TileHeights& part) {
  samples += part.samples;
  uncovered += part.uncovered;
  // Break ties so that the order of parts does not matter.
  const auto rank = [](const TileHeights& h) {
    return std::tuple(h.max_error, -h.longitude, -h.latitude);
  };
  if (rank(part) <= rank(*this)) return;
  max_error = part.max_error;
  longitude = part.longitude;
  latitude = part.latitude;
}

TileHeights measure_tile(const TileAddress& address, const TileMesh& mesh, TileSurface& surface,
                         const TileAddress& part) {
  std::vector<std::uint32_t> triangles(mesh.triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) triangles[t] = t;
  Measurement measurement(address, mesh, surface);
  measurement.part(box_of(part), triangles);
  return measurement.result;
}

std::uint64_t count_samples(const TileAddress& address, TileSurface& surface) {
  const GeographicBox tile_box = box_of(address);
  std::uint64_t count = 0;
  for_each_part(tile_box, surface, [&](const SurfaceSamples& samples) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double longitude = samples.longitude[i], latitude = samples.latitude[i];
      const bool inside = longitude > tile_box.west && longitude < tile_box.east &&
                          latitude > tile_box.south && latitude < tile_box.north;
      count += inside ? 1 : 0;
    }
  });
  return count;
}

}  // namespace terrace::terrain
