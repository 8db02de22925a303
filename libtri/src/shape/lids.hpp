// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "../delaunay3/star.hpp"
#include "spheres.hpp"
#include "terrace/tri/shape.hpp"

/// Lids: the faces by which a closed surface bridges what an open scan has not seen. See
/// BasicShape3::surface_without_lids().

namespace terrace::tri::shape {

inline constexpr double kLidSpacings = 10.0;
inline constexpr std::size_t kSpacingRank = 6;
inline constexpr double kLidShare = 0.1;

template <class Mesh>
class LidFinder {
 public:
  LidFinder(const Mesh& mesh, const std::vector<Place>& places) : mesh_(mesh), places_(places) {
    nearest2_.assign(places.size(), std::numeric_limits<double>::infinity());
    for (std::uint32_t t = 0; t < mesh.tetrahedron.size(); ++t) {
      const auto& corner = mesh.tetrahedron[t].corner;
      if (!spatial::is_finite(corner)) continue;
      for (std::size_t i = 0; i < 4; ++i) {
        for (std::size_t j = i + 1; j < 4; ++j) {
          const double d2 = distance2(corner[i], corner[j]);
          nearest2_[corner[i]] = std::min(nearest2_[corner[i]], d2);
          nearest2_[corner[j]] = std::min(nearest2_[corner[j]], d2);
        }
      }
    }
    spacing2_.assign(places.size(), -1.0);
  }

  /// Whether an edge of the face is longer than ten times the spacing at each of its corners.
  bool lid(const std::array<std::uint32_t, 3>& face) {
    const double longest2 = std::max(
        {distance2(face[0], face[1]), distance2(face[1], face[2]), distance2(face[2], face[0])});
    const double limit2 = longest2 / (kLidSpacings * kLidSpacings);
    // No spacing is below the distance of the nearest vertex.
    return std::all_of(face.begin(), face.end(),
                       [&](std::uint32_t v) { return nearest2_[v] < limit2; }) &&
           std::all_of(face.begin(), face.end(),
                       [&](std::uint32_t v) { return spacing2(v) < limit2; });
  }

  [[nodiscard]] double area2(const std::array<std::uint32_t, 3>& face) const {
    const Vector3 normal = cross(minus(places_[face[1]].at, places_[face[0]].at),
                                 minus(places_[face[2]].at, places_[face[0]].at));
    return std::sqrt(dot(normal, normal));
  }

 private:
  [[nodiscard]] double distance2(std::uint32_t a, std::uint32_t b) const {
    const Vector3 d = minus(places_[a].at, places_[b].at);
    return dot(d, d);
  }
  /// The square of the sixth shortest Delaunay edge at the vertex, or of the longest of fewer.
  double spacing2(std::uint32_t v) {
    if (spacing2_[v] >= 0.0) return spacing2_[v];
    std::vector<std::uint32_t> others;
    spatial::Star star(mesh_, v);
    for (std::uint32_t t = star.next(); t != spatial::kNone; t = star.next())
      for (const std::uint32_t other : mesh_.tetrahedron[t].corner)
        if (other != v && other != spatial::kGhost) others.push_back(other);
    std::sort(others.begin(), others.end());
    others.erase(std::unique(others.begin(), others.end()), others.end());
    std::vector<double> lengths2;
    lengths2.reserve(others.size());
    for (const std::uint32_t other : others) lengths2.push_back(distance2(v, other));
    const std::size_t rank = std::min(kSpacingRank, lengths2.size()) - 1;
    std::nth_element(lengths2.begin(), lengths2.begin() + static_cast<std::ptrdiff_t>(rank),
                     lengths2.end());
    return spacing2_[v] = lengths2[rank];
  }

  const Mesh& mesh_;
  const std::vector<Place>& places_;
  std::vector<double> nearest2_, spacing2_;  ///< by vertex slot
};

/// Removes the lids of an open scan, and the vertices that only they have; sets `open`.
template <class Mesh>
void leave_out_lids(const Mesh& mesh, const std::vector<Place>& places, ShapeSurface& result) {
  using Face = std::array<std::uint32_t, 3>;
  std::vector<Face>& faces = result.surface.faces;
  LidFinder finder(mesh, places);
  std::vector<double> lids, others;  // areas, sorted before they are added
  std::vector<bool> is_lid(faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    Face face;
    for (std::size_t i = 0; i < 3; ++i) face[i] = slot(result.vertices[faces[f][i]]);
    is_lid[f] = finder.lid(face);
    (is_lid[f] ? lids : others).push_back(finder.area2(face));
  }
  if (lids.empty()) return;
  const auto sum = [](std::vector<double>& areas) {
    std::sort(areas.begin(), areas.end());
    double total = 0.0;
    for (const double area : areas) total += area;
    return total;
  };
  const double of_lids = sum(lids), of_others = sum(others);
  if (!(of_lids > kLidShare * (of_lids + of_others))) return;

  result.open = true;
  std::vector<bool> used(result.vertices.size());
  std::size_t kept = 0;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (is_lid[f]) continue;
    result.behind[kept] = result.behind[f];
    faces[kept++] = faces[f];
    for (const std::uint32_t v : faces[f]) used[v] = true;
  }
  faces.resize(kept);
  result.behind.resize(kept);
  std::vector<std::uint32_t> number(used.size());
  std::uint32_t count = 0;
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (!used[v]) continue;
    number[v] = count;
    result.vertices[count] = result.vertices[v];
    result.surface.points[count++] = result.surface.points[v];
  }
  result.vertices.resize(count);
  result.surface.points.resize(count);
  for (Face& face : faces)
    for (std::uint32_t& v : face) v = number[v];
}

}  // namespace terrace::tri::shape
