// SPDX-License-Identifier: Apache-2.0
#include "flood.hpp"

#include <algorithm>

#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "int_kernel.hpp"

namespace terrace::tri::planar {
namespace {

/// In a queue's entry in place of the side that it was entered by.
constexpr std::uint32_t kNoSide = 3;

/// Arrays of the flood; each triangle adds at most three entries to the queue and one to the
/// others.
struct Output {
  explicit Output(Region& region) : region_(region) {}
  void make_room(std::size_t entries) {
    if (entries > size_) [[unlikely]]
      grow(static_cast<std::uint32_t>(entries));
  }

  Side* queue = nullptr;
  std::uint32_t* triangles = nullptr;
  std::uint32_t* mixed = nullptr;
  Side* rim = nullptr;

 private:
  void grow(std::uint32_t entries) {
    size_ = entries + entries / 2;
    const auto grown = [size = size_](auto& array) {
      array.resize(size);
      return array.data();
    };
    queue = grown(region_.queue);
    triangles = grown(region_.triangles);
    mixed = grown(region_.mixed);
    rim = grown(region_.rim);
  }

  Region& region_;
  std::uint32_t size_ = 0;
};

}  // namespace

template <class Kernel>
void flood(Mesh<Kernel>& mesh) {
  Region& region = mesh.region;
  Output out(region);
  std::size_t tail = 0;
  out.make_room(4 * region.removed.size());
  Triangle* const triangle = mesh.triangle.data();
  const std::uint8_t* const mark = mesh.mark.data();
  std::uint32_t* const incident = mesh.incident.data();
  const auto push = [&](Side side, bool really) {
    out.queue[tail] = side;
    tail += really ? 1 : 0;
    __builtin_prefetch(&triangle[triangle_of(side)], 1);
  };
  // A triangle of every vertex: the set need not be connected.
  for (const std::uint32_t v : region.removed) push(make_side(incident[v], kNoSide), true);

  std::uint32_t triangles = 0;
  std::uint32_t mixed = 0;
  std::uint32_t rim = 0;
  for (std::size_t head = 0; head < tail; ++head) {
    out.make_room(tail + 3);
    const std::uint32_t t = triangle_of(out.queue[head]);
    const std::uint32_t entered = index_of(out.queue[head]);
    Triangle& at = triangle[t];
    const bool fresh = (at.corner[0] & kInRegion) == 0;
    const unsigned a = mark[at.corner[0] & ~kInRegion];
    const unsigned b = mark[at.corner[1]];
    const unsigned c = mark[at.corner[2]];
    at.corner[0] |= kInRegion;
    out.triangles[triangles] = t;
    triangles += fresh ? 1 : 0;
    // What lies across an edge with a removed vertex belongs to the region too.
    push(at.mate[0], fresh & ((b | c) != 0) & (entered != 0));
    push(at.mate[1], fresh & ((c | a) != 0) & (entered != 1));
    push(at.mate[2], fresh & ((a | b) != 0) & (entered != 2));
    const unsigned count = a + b + c;
    out.mixed[mixed] = t;
    mixed += (fresh & (count < 3)) ? 1 : 0;
    out.rim[rim] = make_side(t, b + 2 * c);
    rim += (fresh & (count == 1)) ? 1 : 0;
  }
  region.triangles.resize(triangles);
  region.mixed.resize(mixed);

  // The edges between kept vertices that have the region on one side only.
  region.boundary.clear();
  for (std::uint32_t k = 0; k < rim; ++k) {
    const Triangle& at = triangle[triangle_of(out.rim[k])];
    const std::uint32_t i = index_of(out.rim[k]);
    const Side outer = at.mate[i];
    if ((triangle[triangle_of(outer)].corner[0] & kInRegion) != 0) continue;
    const std::uint32_t from = at.corner[next_index(i)] & ~kInRegion;
    __builtin_prefetch(&incident[from], 1);
    region.boundary.push_back({from, at.corner[previous_index(i)] & ~kInRegion, outer});
  }
}

template <class Kernel>
void dry(Mesh<Kernel>& mesh) {
  for (const std::uint32_t t : span_of(mesh.region.triangles))
    mesh.triangle[t].corner[0] &= ~kInRegion;
}

#ifdef TERRACE_TRI_CORE
template void flood(Mesh<IntKernel>&);
template void dry(Mesh<IntKernel>&);
#else
template void flood(Mesh<DoubleKernel>&);
template void flood(Mesh<EllipticalKernel>&);
template void dry(Mesh<DoubleKernel>&);
template void dry(Mesh<EllipticalKernel>&);
#endif

}  // namespace terrace::tri::planar
