// SPDX-License-Identifier: Apache-2.0
#include "removal.hpp"

#include <cmath>

#include "tin/ground.hpp"

namespace terrace::tri::tin::points {

namespace {

class Remover {
 public:
  Remover(Mesh& mesh, double bound, double min_angle_degrees)
      : mesh_(mesh),
        bound_(bound),
        tangent_(tangent_of(min_angle_degrees)),
        triangle_of_(triangle_of_vertices(mesh.triangles, mesh.vertices.size())) {}

  bool remove(std::uint32_t v) {
    if (triangle_of_[v] == kNone || !star_.gather(mesh_.triangles, v, triangle_of_[v]))
      return false;
    const Vertex& vertex = mesh_.vertices[v];
    const bool own = vertex.sample != kNone && (*mesh_.samples)[vertex.sample].next == kIsVertex;
    samples_.gather(mesh_, star_, vertex, own ? vertex.sample : kNone);
    if (samples_.out_of_reach(samples_.own(), bound_)) return false;
    if (!fill_delaunay() &&
        (samples_.out_of_reach(samples_.beyond(), bound_) || !fill_within_bound()))
      return false;
    star_.replace(mesh_.triangles, fill_, triangle_of_, v);
    samples_.list(mesh_, star_, fill_);
    return true;
  }

 private:
  [[nodiscard]] Place2 place(std::size_t i) const { return mesh_.place(star_.ring(i)); }
  [[nodiscard]] bool left(std::size_t i, std::size_t m, std::size_t j) const {
    return mesh_.orientation(place(i), place(m), place(j)) > 0;
  }

  bool fill_delaunay() {
    return tin::fill_delaunay(
               star_.size(),
               [&](std::size_t i, std::size_t m, std::size_t j) { return left(i, m, j); },
               [&](std::size_t i, std::size_t m, std::size_t j, std::size_t p) {
                 return mesh_.in_circle(place(i), place(m), place(j), place(p)) > 0;
               },
               fill_) &&
           star_.all_of(fill_, [&](std::size_t i, std::size_t m, std::size_t j) {
             return samples_.worst(i, m, j, bound_) <= bound_;
           });
  }

  bool fill_within_bound() {
    return fill_least_worst(
        star_.size(), bound_,
        [&](std::size_t i, std::size_t m, std::size_t j, double limit) {
          if (!left(i, m, j) || !samples_.wide(i, m, j, tangent_)) return HUGE_VAL;
          return samples_.worst(i, m, j, limit);
        },
        fill_);
  }

  Mesh& mesh_;
  double bound_;
  double tangent_;
  std::vector<std::uint32_t> triangle_of_;
  Star star_;
  StarSamples samples_;
  PolygonFill fill_;
};

}  // namespace

std::size_t remove_vertices(Mesh& mesh, std::size_t fixed, double bound, double min_angle_degrees) {
  Remover remover(mesh, bound, min_angle_degrees);
  std::size_t removed = 0;
  for (auto v = static_cast<std::uint32_t>(fixed); v < mesh.vertices.size(); ++v)
    removed += remover.remove(v) ? 1 : 0;
  return removed;
}

}  // namespace terrace::tri::tin::points
