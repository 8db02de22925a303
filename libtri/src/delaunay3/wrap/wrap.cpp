// SPDX-License-Identifier: Apache-2.0
// Gift wrapping of a hole. A facet with the hole in front of it determines its tetrahedron: the
// empty sphere grows along the facet's axis until it meets a vertex. Facets can therefore be taken
// in any order. Each of a new tetrahedron's other facets either meets an open one, which closes
// both, or becomes open. There are no validity rules, no required order and no failure cases.
//
// The first vertex that the sphere meets is found in double with error bounds, for all vertices of
// the hole at once. Exact (and perturbed) sphere tests compare the vertices that the bounds cannot
// separate.
//
// If no vertex is in front of a facet, it is on the hull, and the tetrahedron is a ghost. Facets
// with the ghost never need wrapping: every new ghost has a finite facet, and the finite tetrahedra
// of a hole are connected by finite facets, one of which is on the hole's boundary.
#include "wrap.hpp"

#include <cmath>
#include <limits>

#include "delaunay3/double_kernel.hpp"
#include "delaunay3/elliptical_kernel.hpp"
#include "delaunay3/int_kernel.hpp"
#include "delaunay3/predicates.hpp"

namespace terrace::tri::spatial {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kUnit = 0x1p-53;

template <class Kernel>
class Wrapping {
 public:
  using Point = typename Kernel::Point;

  Wrapping(Mesh<Kernel>& mesh, HoleFilling<Kernel>& filling)
      : mesh_(mesh), hole_(mesh.hole), filling_(filling) {}

  void run() {
    prepare();
    for (std::uint32_t i = filling_.next_open(); i != kNone; i = filling_.next_open()) {
      const auto [a, b, c] = hole_.facets[i].corner;
      filling_.attach(i, choose(a, b, c));
    }
  }

 private:
  void prepare() {
    count_ = hole_.vertex.size();
    const std::size_t padded = (count_ + kScanPadding - 1) / kScanPadding * kScanPadding;
    std::array<std::vector<double>*, 3> axis = {&hole_.x, &hole_.y, &hole_.z};
    double square = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      std::vector<double>& c = *axis[k];
      c.assign(padded, std::numeric_limits<double>::quiet_NaN());
      double low = kInfinity;
      double high = -kInfinity;
      for (std::size_t i = 1; i < count_; ++i) {
        c[i] = static_cast<double>(scan_point(hole_.point[i])[k]);
        low = std::min(low, c[i]);
        high = std::max(high, c[i]);
      }
      square += (high - low) * (high - low);
    }
    // Upper bound of the length of any vector between vertices.
    length_ = std::sqrt(square) * (1 + 0x1p-40);
    if constexpr (kMapped) {
      // Both ends of a vector have an error of 9 u spread() times their distances from the first
      // vertex.
      const double spread = EllipticalKernel::form().spread();
      length_ *= 1 + 0x1p-20;
      vector_error_ = spread < 0x1p28 ? 18.5 * kUnit * spread * length_ : kInfinity;
    }
    if (hole_.power.size() < padded) {
      hole_.power.resize(padded);
      hole_.volume.resize(padded);
      hole_.near.resize(padded);
    }
    vertices_ = {hole_.x.data(), hole_.y.data(),     hole_.z.data(),
                 padded,         hole_.power.data(), hole_.volume.data()};
  }

  /// The point as scan() uses it. In an elliptical metric it is mapped to where the metric is
  /// Euclidean.
  Point scan_point(const Point& p) const {
    if constexpr (kMapped) {
      return EllipticalKernel::mapped(p, hole_.point[1]);
    } else {
      return p;
    }
  }

  /// The first vertex that the growing sphere meets, or 0, the ghost.
  std::uint32_t choose(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    ScanFacet facet;
    double volume_error = kInfinity;
    std::size_t near = 0;
    if (measure(a, b, c, facet)) {
      volume_error = facet.volume_error;
      near = hole_.scan(vertices_, facet, hole_.near.data());
      if (near == 1 && hole_.volume[hole_.near[0]] > volume_error) [[likely]]
        return hole_.near[0];
    } else {
      while (++near < count_) hole_.near[near - 1] = static_cast<std::uint32_t>(near);
      --near;
    }
    std::uint32_t best = 0;
    for (std::size_t i = 0; i < near; ++i) {
      const std::uint32_t d = hole_.near[i];
      if (d == a || d == b || d == c) continue;
      const bool certain = hole_.volume[d] > volume_error;
      if (!certain &&
          Kernel::orientation(hole_.point[d], hole_.point[a], hole_.point[b], hole_.point[c]) <= 0)
        continue;
      if (best == 0 || beats(d, best, a, b, c)) best = d;
    }
    return best;
  }
  bool beats(std::uint32_t d, std::uint32_t best, std::uint32_t a, std::uint32_t b,
             std::uint32_t c) const {
    const auto at = [&](std::uint32_t k) -> const auto& { return mesh_.vertex[hole_.vertex[k]]; };
    return inside_sphere<Kernel>(at(best), at(a), at(b), at(c), hole_.point[d], mesh_.lattice);
  }

  /// Prepares the facet for scan(). Returns false if the error bounds could not be trusted.
  ///
  /// With u = 2^-53, edges e and f from the corner, normal n = e x f, b = |e| |f| (|e| + |f|), k =
  /// |e| |f| / |n|, the errors to first order are as follows. Each coordinate of n has an error of
  /// at most 4 u |e| |f| (including differences), n of 7 u |e| |f|. A volume then has an error of 7
  /// u |e| |f| w + 4 u |e| |f| w, where w is the length of the vertex's vector. r = |e|^2 f - |f|^2
  /// e, of length at most b, has an error of 8 u b; r x n of 25 k u b |n|; |n|^2 a relative error
  /// of 17 k u. The diameter, their quotient, therefore has an error of 43 k u b / |n|, and its
  /// length is at most b / |n|. A power has an error of that times w, plus 6 u w (w + b / |n|) for
  /// its own operations. The constants below are larger by at least a tenth, which covers omitted
  /// terms and the operations of code that uses the bounds.
  bool measure(std::uint32_t a, std::uint32_t b, std::uint32_t c, ScanFacet& facet) const {
    const std::array<const double*, 3> axis = {hole_.x.data(), hole_.y.data(), hole_.z.data()};
    std::array<double, 3> e;
    std::array<double, 3> f;
    double ee = 0;
    double ff = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      facet.corner[k] = axis[k][a];
      e[k] = axis[k][c] - axis[k][a];
      f[k] = axis[k][b] - axis[k][a];
      ee += e[k] * e[k];
      ff += f[k] * f[k];
    }
    std::array<double, 3> r;
    double nn = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3;
      const std::size_t m = (k + 2) % 3;
      facet.normal[k] = e[l] * f[m] - e[m] * f[l];
      nn += facet.normal[k] * facet.normal[k];
      r[k] = ee * f[k] - ff * e[k];
    }
    const double lengths = std::sqrt(ee * ff);
    const double normal = std::sqrt(nn);
    const double k = lengths / normal;
    if (!(k < 0x1p40 && normal > 0x1p-400 && length_ < 0x1p150)) return false;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t l = (i + 1) % 3;
      const std::size_t m = (i + 2) % 3;
      facet.diameter[i] = (r[l] * facet.normal[m] - r[m] * facet.normal[l]) / nn;
    }
    const double diameter = k * (std::sqrt(ee) + std::sqrt(ff));
    facet.power_error = length_ * kUnit * (48 * k * diameter + 12 * (length_ + diameter));
    // Small enough integers give exact results: 6 w^3 < 2^53.
    const bool exact = std::is_same_v<typename Kernel::Coord, std::int32_t> && length_ < 114'000;
    facet.volume_error = exact ? 0 : 16 * kUnit * lengths * length_;
    return !kMapped || add_vector_errors(std::sqrt(ee) + std::sqrt(ff), lengths, normal, facet);
  }

  /// Adds the errors of mapped vectors: each has an error of d, vector_error_. Let s be the sum of
  /// the lengths of e and f. To first order, n then has an error of s d, and r, of length at most k
  /// s |n|, of 1.5 s^2 d, so the diameter has an error of (1.5 s^2 + 3 k s^2) d / |n|, where k is
  /// at least 1. Returns false if that could be a large part of the diameter.
  bool add_vector_errors(double s, double lengths, double normal, ScanFacet& facet) const {
    const double d = 1.1 * vector_error_;
    if (!(s * d < 0x1p-20 * normal)) return false;
    const double k = lengths / normal;
    const double diameter_error = 4.5 * k * s * (s / normal) * d;
    facet.volume_error += (s * length_ + lengths) * d;
    facet.power_error += (2 * length_ + k * s) * d + length_ * diameter_error;
    return true;
  }

  static constexpr bool kMapped = std::is_same_v<Kernel, EllipticalKernel>;

  Mesh<Kernel>& mesh_;
  Hole<Point>& hole_;
  HoleFilling<Kernel>& filling_;
  ScanVertices vertices_{};
  std::size_t count_ = 0;
  double length_ = 0;
  double vector_error_ = 0;  ///< error of vectors between vertices if they are mapped
};

}  // namespace

template <class Kernel>
void wrap_rest(Mesh<Kernel>& mesh, HoleFilling<Kernel>& filling) {
  Wrapping<Kernel>(mesh, filling).run();
  filling.finish();
}

template <class Kernel>
void wrap_hole(Mesh<Kernel>& mesh) {
  HoleFilling<Kernel> filling(mesh);
  wrap_rest(mesh, filling);
}

#ifdef TERRACE_TRI_CORE
template void wrap_rest(Mesh<IntKernel>&, HoleFilling<IntKernel>&);
template void wrap_hole(Mesh<IntKernel>&);
#else
template void wrap_rest(Mesh<DoubleKernel>&, HoleFilling<DoubleKernel>&);
template void wrap_rest(Mesh<EllipticalKernel>&, HoleFilling<EllipticalKernel>&);
template void wrap_hole(Mesh<DoubleKernel>&);
template void wrap_hole(Mesh<EllipticalKernel>&);
#endif

}  // namespace terrace::tri::spatial
