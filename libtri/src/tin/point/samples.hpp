// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mesh.hpp"
#include "pool.hpp"
#include "terrace/tri/point_tin.hpp"
#include "tin/scan.hpp"
#include "tin/star.hpp"

namespace terrace::tri::tin::points {

/// The triangles around a new vertex, as sectors to which samples are assigned.
class Fan {
 public:
  /// `open`: the vertex is on the border, so there is one more ray than sectors.
  void start(const Vertex& apex, bool open);
  void add_ray(const Vertex& end);
  /// Must be called after the last ray.
  void finish();

  /// Assigns the samples of a list to sectors, except for `excluded`.
  void assign_samples(Sample* samples, std::uint32_t head, std::uint32_t excluded);
  /// Terminates the sectors' lists.
  void end_lists();

  struct Sector {
    std::uint32_t* end;  ///< the place of the link to the sector's next sample
    std::uint32_t head;
    /// sample of greatest error that is not stuck, kNone if there is none
    std::uint32_t worst;
    double error;
  };
  [[nodiscard]] const std::vector<Sector>& sectors() const { return sectors_; }

 private:
  [[nodiscard]] std::size_t sector_of(double dx, double dy) const;
  [[nodiscard]] std::size_t sector_of_many(double dx, double dy) const;
  [[nodiscard]] double height_without_plane(std::size_t sector, const Sample& sample) const;

  Vertex apex_{};
  bool open_ = false;
  std::vector<Vertex> rays_;  ///< end points of the rays
  std::size_t half_ = 0;      ///< the first ray at least 180 degrees to the left of ray 0
  /// Directions of the rays in pairs, padded with zeros: 2 x, 2 y.
  std::vector<double> pairs_;
  std::vector<Plane> planes_;  ///< by sector
  std::vector<Sector> sectors_;
};

class PointHole;

/// Irregular samples, see tin::Samples: a list of them per triangle, in the triangle that contains
/// them up to rounding. A sample's place is its index.
class PointSamples {
 public:
  using Vertex = points::Vertex;
  using Vertices = Pool<Vertex>;
  using Hole = PointHole;
  using FirstSide = RandomSide;
  static constexpr bool kMovesVertices = true;
  static constexpr std::size_t kMaxFittedTriangles = kMaxRing;

  /// The lists are empty, and have room for a mesh with a vertex for each sample. `integers`: true
  /// if SmallIntegerKernel can handle the vertices.
  PointSamples(Pool<Sample>& all, double bound, const PointTinOptions& options, bool border_fixed,
               bool integers, const Triangles& triangles);

  Pool<Sample>& all() { return all_; }
  const Pool<Sample>& all() const { return all_; }
  /// Heads of the triangles' lists, kNone if empty.
  Pool<std::uint32_t>& heads() { return heads_; }
  const Pool<std::uint32_t>& heads() const { return heads_; }
  /// Gives new triangles empty lists.
  void add_lists(const Triangles& triangles);
  double bound() const { return bound_; }
  double tangent() const {
    return tangent_;
  }  ///< tangent of the smallest angle, see PointTinOptions
  bool on_lattice() const { return lattice_.has_value(); }

  template <class At>
  int turn(const Vertex& a, const Vertex& b, const At& p) const {
    return Kernel::orientation(place(a), place(b), place(p));
  }
  bool in_circle(const Vertex& a, const Vertex& b, const Vertex& c, const Vertex& p) const {
    return (integers_ ? SmallIntegerKernel::in_circle(place(a), place(b), place(c), place(p))
                      : Kernel::in_circle(place(a), place(b), place(c), place(p))) > 0;
  }
  bool left(const Vertex& a, const Vertex& b, const Vertex& c) const {
    return (integers_ ? SmallIntegerKernel::orientation(place(a), place(b), place(c))
                      : Kernel::orientation(place(a), place(b), place(c))) > 0;
  }
  bool border_fixed() const { return border_fixed_; }

  void set_error(PointMesh& mesh, std::uint32_t t) const;
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
  bool border_fixed_, integers_;
  Fan fan_;
};

}  // namespace terrace::tri::tin::points
