// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "int_kernel.hpp"
#include "operations.hpp"
#include "predicates.hpp"
#include "windowed_kernel.hpp"

namespace terrace::tri::planar {
namespace {

/// Chooses the apex of the triangle at the base from vertex[last] to vertex[first], to the left of
/// which is the part (first, ..., last) of the polygon.
template <class Kernel>
class ApexChoice {
 public:
  using Point = typename Kernel::Point;

  explicit ApexChoice(const Hole<Point>& hole)
      : vertex_(hole.vertex.data()), point_(hole.point.data()) {}

  [[nodiscard]] std::uint32_t operator()(std::uint32_t first, std::uint32_t last) const {
    if (last - first == 2) return first + 1;
    if (vertex_[last] == kGhost)
      return best(first, last, [&](std::uint32_t x, std::uint32_t y) {
        return inside_ghost<Kernel>(point_[first], point_[x], point_[y]);
      });
    if (vertex_[first] == kGhost)
      return best(first, last, [&](std::uint32_t x, std::uint32_t y) {
        return inside_ghost<Kernel>(point_[x], point_[last], point_[y]);
      });
    return at_finite_base(first, last);
  }

 private:
  // Returns the candidate that no other candidate beats.
  template <class LosesTo>
  std::uint32_t best(std::uint32_t first, std::uint32_t last, LosesTo loses_to) const {
    std::uint32_t result = first + 1;
    for (std::uint32_t m = first + 2; m < last; ++m)
      if (loses_to(result, m)) result = m;
    return result;
  }

  std::uint32_t at_finite_base(std::uint32_t first, std::uint32_t last) const {
    const Point b = point_[last];
    const Point c = point_[first];
    std::uint32_t result = kNone;
    std::uint32_t ghost = kNone;
    double least = 0;  // cotangent of the largest angle so far
    for (std::uint32_t m = first + 1; m < last; ++m) {
      if (vertex_[m] == kGhost) [[unlikely]] {
        ghost = m;
        continue;
      }
      const Point a = point_[m];
      if (Kernel::orientation(a, b, c) <= 0) continue;
      const auto angle = Kernel::angle(a, b, c);
      const double cotangent = static_cast<double>(angle.dot) / static_cast<double>(angle.cross);
      if (result == kNone || beats(cotangent, least, m, result, b, c)) {
        result = m;
        least = cotangent;
      }
    }
    assert(result != kNone || ghost != kNone);
    return result != kNone ? result : ghost;
  }

  // True if candidate m is inside the circle of the base and the best candidate so far.
  bool beats(double cotangent, double least, std::uint32_t m, std::uint32_t best_so_far,
             const Point& b, const Point& c) const {
    if constexpr (std::is_same_v<Kernel, IntKernel>) {
      // Both quotients are of exact integers, with three roundings each. (Integers meet floating
      // point only here; undecided cases are decided exactly.)
      const double margin = 0x1p-50 * (std::abs(cotangent) + std::abs(least));
      if (std::abs(cotangent - least) > margin) return cotangent < least;
    }
    return inside_circle<Kernel>(point_[best_so_far], b, c, point_[m]);
  }

  const std::uint32_t* vertex_;
  const Point* point_;
};

}  // namespace

template <class Kernel>
void fill_hole(Mesh<Kernel>& mesh) {
  auto& hole = mesh.hole;
  constexpr std::size_t kTicksOfCandidate = 16;
  const ApexChoice<Kernel> choose_apex(hole);
  const auto count = static_cast<std::uint32_t>(hole.vertex.size());
  assert(hole.vertex.front() != kGhost && hole.vertex.back() != kGhost);

  const auto close_edge = [&](std::uint32_t edge, Side inner) {
    mesh.link(inner, hole.outer[edge]);
    mesh.incident[hole.vertex[edge]] = triangle_of(inner);
  };
  close_edge(count - 1, make_side(hole.slots.back(), 0));
  hole.parts.clear();
  hole.parts.push_back({0, count - 1, hole.outer[count - 1]});
  while (!hole.parts.empty()) {
    const auto [first, last, mate] = hole.parts.back();
    hole.parts.pop_back();
    mesh.ticks(kTicksOfCandidate * (last - first));
    const std::uint32_t apex = choose_apex(first, last);
    const std::uint32_t t = hole.slots.back();
    hole.slots.pop_back();
    mesh.triangle[t].corner = {hole.vertex[apex], hole.vertex[last], hole.vertex[first]};
    mesh.link(make_side(t, 0), mate);
    if (apex == first + 1) {
      close_edge(first, make_side(t, 1));
    } else {
      hole.parts.push_back({first, apex, make_side(t, 1)});
    }
    if (last == apex + 1) {
      close_edge(apex, make_side(t, 2));
    } else {
      hole.parts.push_back({apex, last, make_side(t, 2)});
    }
  }
}

#ifdef TERRACE_TRI_CORE
template void fill_hole(Mesh<IntKernel>&);
template void fill_hole(Mesh<WindowedKernel>&);
#else
template void fill_hole(Mesh<DoubleKernel>&);
template void fill_hole(Mesh<EllipticalKernel>&);
#endif

}  // namespace terrace::tri::planar
