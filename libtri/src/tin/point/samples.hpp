// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "fan.hpp"
#include "mesh.hpp"
#include "pool.hpp"
#include "terrace/tri/point_tin.hpp"
#include "tin/scan.hpp"
#include "tin/star.hpp"

namespace terrace::tri::tin::points {

class PointHole;

/// Irregular samples, see tin::Samples: a list of them per triangle, in the triangle that contains
/// them up to rounding. A sample's place is its index.
class PointSamples {
 public:
  using Vertex = points::Vertex;
  using Vertices = Pool<Vertex>;
  using Hole = PointHole;
  using FirstSide = RandomSide;
  static constexpr bool kMoved = true;
  static constexpr std::size_t kMostFitted = kMaxRing;

  /// The lists are empty, and have room for a mesh with a vertex for each sample. `whole`: true if
  /// WholeKernel can handle the vertices.
  PointSamples(Pool<Sample>& all, double bound, const PointTinOptions& options, bool border_fixed,
               bool whole, const Triangles& triangles);

  Pool<Sample>& all() { return all_; }
  const Pool<Sample>& all() const { return all_; }
  /// Heads of the triangles' lists, kNone if empty.
  Pool<std::uint32_t>& heads() { return heads_; }
  const Pool<std::uint32_t>& heads() const { return heads_; }
  /// Gives new triangles empty lists.
  void add_lists(const Triangles& triangles);
  double bound() const { return bound_; }
  double tangent() const { return tangent_; }  ///< of the smallest angle, see PointTinOptions
  bool on_lattice() const { return lattice_.has_value(); }

  template <class At>
  int turn(const Vertex& a, const Vertex& b, const At& p) const {
    return Kernel::orientation(place(a), place(b), place(p));
  }
  bool in_circle(const Vertex& a, const Vertex& b, const Vertex& c, const Vertex& p) const {
    return (whole_ ? WholeKernel::in_circle(place(a), place(b), place(c), place(p))
                   : Kernel::in_circle(place(a), place(b), place(c), place(p))) > 0;
  }
  bool left(const Vertex& a, const Vertex& b, const Vertex& c) const {
    return (whole_ ? WholeKernel::orientation(place(a), place(b), place(c))
                   : Kernel::orientation(place(a), place(b), place(c))) > 0;
  }
  bool border_fixed() const { return border_fixed_; }

  void judge(PointMesh& mesh, std::uint32_t t) const;
  void split(PointMesh& mesh, std::span<const std::uint32_t> created, std::uint32_t place,
             std::uint32_t t, const Spot& spot);
  static bool open(std::uint32_t) { return true; }
  /// On a lattice the vertex is rounded, otherwise at the sample.
  Vertex take(std::uint32_t place) const;
  void give_up(std::uint32_t place) {
    if (all_[place].next != kIsVertex) all_[place].id |= kStuck;
  }
  void restore() {}
  static bool counts(const Vertex&) { return true; }

  void narrow(std::uint32_t t, const Vertex& v, const Vertex& b, const Vertex& c,
              Interval& rises) const;
  bool raise(Vertex& v, const Interval& rises) const;
  bool within(const PointMesh& mesh, std::uint32_t t, const Vertex&, const Vertex&,
              const Vertex&) const;
  static bool covers(const Vertex&, const Vertex&, const Vertex&) { return true; }
  /// The vertices must have the callers' numbers of samples by now.
  static void publish(const Vertex& vertex, PointTin& tin) {
    tin.vertices.push_back({vertex.x, vertex.y, vertex.z});
    tin.sample.push_back(vertex.sample);
  }

 private:
  void set_error(Triangle& triangle, std::uint32_t worst, double error) const;
  /// Moves a sample from one triangle's list to another's.
  void move(std::uint32_t index, std::uint32_t from, std::uint32_t to);

  Pool<Sample>& all_;
  Pool<std::uint32_t> heads_;
  double bound_, tangent_;
  std::optional<TinLattice> lattice_;
  bool border_fixed_, whole_;
  Fan fan_;
};

}  // namespace terrace::tri::tin::points
