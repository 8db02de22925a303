// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "../delaunay3/star.hpp"
#include "spheres.hpp"
#include "terrace/tri/shape.hpp"

/// Finds lids: the faces with which a closed surface bridges the areas that an open scan does not
/// cover. See BasicShape3::surface_without_lids().

namespace terrace::tri::shape {

inline constexpr double kLidSpacings = 10.0;
/// Samples at the border of an open scan have few neighbours except those across its gaps.
inline constexpr std::size_t kSpacingRank = 3;
/// A scan is open if lids are more than this fraction (1 / kLidParts) of its area.
inline constexpr std::int64_t kLidParts = 10;

/// Twice the area of a face, mantissa * 2^(bin - kOffset), cut to 18 bits. Sums of such areas are
/// exact, so they do not depend on the order in which faces are added and removed.
struct LidFace {
  static constexpr int kOffset = 2700, kBins = 4800;

  std::uint32_t mantissa : 18, bin : 13, lid : 1;
};
static_assert(sizeof(LidFace) == 4);

/// The share of lids in an area, by exponent.
class LidShare {
 public:
  void add(const LidFace& face) { change(face, 1); }
  void remove(const LidFace& face) { change(face, -1); }
  /// True if more than a tenth of the area is in lids: 9 times the area of the lids exceeds the
  /// rest.
  [[nodiscard]] bool open() const {
    std::int64_t sum = 0;
    bool has_fraction = false;  // true if there is a fraction below the current exponent
    for (const std::int64_t bin : bins_) {
      has_fraction = has_fraction || (sum & 1) != 0;
      sum = bin + (sum >> 1);
    }
    return sum > 0 || (sum == 0 && has_fraction);
  }

 private:
  void change(const LidFace& face, std::int64_t sign) {
    bins_[face.bin] += sign * face.mantissa * (face.lid != 0 ? kLidParts - 1 : -1);
  }
  std::vector<std::int64_t> bins_ = std::vector<std::int64_t>(LidFace::kBins);
};

/// The spacing at a vertex, as far as it is known, and the edges that determine it.
struct Spacing {
  static constexpr double kUnknown = -1.0;

  double length = kUnknown;                        ///< the third shortest edge
  std::array<std::uint32_t, kSpacingRank> ends{};  ///< the other ends of the three shortest edges
  /// For LidFinder, bits by index in `ends`: the edges of removed tetrahedra, and those of new
  /// ones.
  std::uint8_t removed = 0, added = 0;
};

/// Requires a scope of the metric.
template <class Mesh>
class LidFinder {
 public:
  using Face = std::array<std::uint32_t, 3>;

  /// spacings: by vertex slot. Computed when lid() needs them.
  LidFinder(const Mesh& mesh, std::vector<Spacing>& spacings) : mesh_(mesh), spacings_(spacings) {
    spacings_.resize(std::max<std::size_t>(spacings_.size(), mesh.vertex.size()));
  }

  /// True if an edge of the face is longer than ten times the spacing at each of its corners.
  bool is_lid(const Face& face) {
    const double limit =
        std::max({length(face[0], face[1]), length(face[1], face[2]), length(face[2], face[0])}) /
        kLidSpacings;
    // The spacings that are not known yet are rarely needed.
    return std::all_of(face.begin(), face.end(),
                       [&](std::uint32_t v) { return spacings_[v].length < limit; }) &&
           std::all_of(face.begin(), face.end(), [&](std::uint32_t v) {
             if (spacings_[v].length < 0.0) find_spacing(v, [](std::uint32_t) {});
             return spacings_[v].length < limit;
           });
  }

  // ---- After changes: call forget() for added and removed vertices, then pass all tetrahedra ----

  void forget(std::uint32_t vertex) { spacings_[vertex] = {}; }
  void remove(const std::array<std::uint32_t, 4>& corners) {
    for_edges(corners,
              [&](Spacing& at, std::uint32_t, std::uint32_t end) { at.removed |= bit(at, end); });
  }
  /// is_new: by vertex slot, true for added vertices.
  void add(const std::array<std::uint32_t, 4>& corners, const std::vector<bool>& is_new) {
    for_edges(corners, [&](Spacing& at, std::uint32_t v, std::uint32_t end) {
      const std::uint8_t end_bit = is_new[end] ? 0 : bit(at, end);
      at.added |= end_bit;
      if (end_bit == 0 && length(v, end) < at.length) at.removed |= kShorter;
    });
  }
  /// Calls changed(v) for vertices whose spacing was known and no longer is.
  template <class Changed>
  void update_spacings(const Changed& changed) {
    for (const std::uint32_t v : touched_) {
      Spacing& at = spacings_[v];
      const bool same = (at.removed & ~at.added) == 0;
      at.removed = at.added = 0;
      if (same) continue;
      at = {};
      changed(v);
    }
    touched_.clear();
  }

  /// Computes a spacing. Calls visit(t) for all tetrahedra at the vertex, including ghosts.
  template <class Visit>
  void find_spacing(std::uint32_t v, const Visit& visit) {
    std::array<double, kSpacingRank> least;
    least.fill(std::numeric_limits<double>::infinity());
    Spacing& at = spacings_[v];
    at.ends.fill(spatial::kNone);
    star_.start(mesh_, v);
    for (std::uint32_t t = star_.next(); t != spatial::kNone; t = star_.next()) {
      visit(t);
      for (const std::uint32_t other : mesh_.tetrahedron[t].corner) {
        if (other == v || other == spatial::kGhost) continue;
        const double edge_length = length(v, other);
        if (edge_length >= least.back() || bit(at, other) != 0) continue;
        std::size_t i = kSpacingRank - 1;
        for (; i > 0 && edge_length < least[i - 1]; --i) {
          least[i] = least[i - 1];
          at.ends[i] = at.ends[i - 1];
        }
        least[i] = edge_length;
        at.ends[i] = other;
      }
    }
    at.length = least.back();
  }
  /// Measures the area of a face. The result is not marked as a lid.
  [[nodiscard]] LidFace measure(Face face) const {
    // In lexicographic order, so that the last bit does not depend on slots.
    const auto order = [&](std::size_t i, std::size_t j) {
      if (spatial::lexicographically_less(mesh_.vertex[face[j]].point, mesh_.vertex[face[i]].point))
        std::swap(face[i], face[j]);
    };
    order(0, 1), order(1, 2), order(0, 1);
    std::array<Vector3, 3> p;
    for (std::size_t i = 0; i < 3; ++i) {
      p[i] = position(face[i]);
      for (double& c : p[i]) c /= 2;  // so that differences cannot overflow
    }
    Vector3 u = edge(mesh_, p[0], p[1]), v = edge(mesh_, p[0], p[2]);
    const double scale = scale_to_one(std::max(largest(u), largest(v)));
    for (std::size_t k = 0; k < 3; ++k) {
      u[k] *= scale;
      v[k] *= scale;
    }
    const Vector3 normal = cross(u, v);
    const double area = std::sqrt(dot(normal, normal));
    if (!(area > 0.0 && area < 0x1p10)) return {};  // flat, or out of range
    int exponent = 0, scale_exponent = 0;
    const double mantissa = std::frexp(area, &exponent);
    std::frexp(scale, &scale_exponent);
    LidFace result{};
    result.mantissa = static_cast<std::uint32_t>(mantissa * 0x1p18) & 0x3FFFFU;
    result.bin =
        static_cast<std::uint32_t>(exponent - 2 * (scale_exponent - 2) + LidFace::kOffset) &
        0x1FFFU;
    return result;
  }

 private:
  [[nodiscard]] Vector3 position(std::uint32_t v) const {
    return to_doubles(mesh_.vertex[v].point);
  }
  [[nodiscard]] double length(std::uint32_t a, std::uint32_t b) const {
    return edge_length(mesh_, position(a), position(b));
  }
  static constexpr std::uint8_t kShorter = 1U << kSpacingRank;

  /// The bit of this edge among the shortest ones, 0 if it is not one of them.
  static std::uint8_t bit(const Spacing& at, std::uint32_t end) {
    std::uint8_t result = 0;
    for (std::size_t i = 0; i < kSpacingRank; ++i)
      if (at.ends[i] == end) result = static_cast<std::uint8_t>(1U << i);
    return result;
  }
  /// Calls visit(spacing, vertex, end) for edges at vertices whose spacing is known.
  template <class Visit>
  void for_edges(const std::array<std::uint32_t, 4>& corners, const Visit& visit) {
    for (const std::uint32_t v : corners) {
      Spacing& at = spacings_[v];
      if (at.length < 0.0) continue;
      const bool first = (at.removed | at.added) == 0;
      for (const std::uint32_t end : corners)
        if (end != v) visit(at, v, end);
      if (first && (at.removed | at.added) != 0) touched_.push_back(v);
    }
  }

  const Mesh& mesh_;
  std::vector<Spacing>& spacings_;
  std::vector<std::uint32_t> touched_;
  spatial::Star<typename Mesh::Kernel> star_;
};

/// Removes the lids of an open scan, and the vertices that only they have. Sets `open` and `lids`.
template <class Mesh>
void remove_lids(const Mesh& mesh, ShapeSurface& result) {
  using Face = std::array<std::uint32_t, 3>;
  std::vector<Face>& faces = result.surface.faces;
  std::vector<Spacing> spacings;
  LidFinder<Mesh> finder(mesh, spacings);
  LidShare share;
  std::vector<bool> is_lid(faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    Face face;
    for (std::size_t i = 0; i < 3; ++i) face[i] = slot(result.vertices[faces[f][i]]);
    LidFace measured = finder.measure(face);
    measured.lid = is_lid[f] = finder.is_lid(face);
    share.add(measured);
  }
  result.lids = static_cast<std::size_t>(std::count(is_lid.begin(), is_lid.end(), true));
  if (!share.open()) return;

  result.open = true;
  std::vector<bool> used(result.vertices.size());
  std::size_t kept = 0;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (is_lid[f]) continue;
    result.tetrahedra[kept] = result.tetrahedra[f];
    faces[kept++] = faces[f];
    for (const std::uint32_t v : faces[f]) used[v] = true;
  }
  faces.resize(kept);
  result.tetrahedra.resize(kept);
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
