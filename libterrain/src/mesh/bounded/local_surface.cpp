// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/local_surface.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <span>

namespace terrace::terrain {

LocalSurface::LocalSurface(const MeshSamples& samples, tri::PointDuplicates duplicates) {
  std::vector<Point2> places;
  places.reserve(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) places.push_back({samples.x[i], samples.y[i]});
  const std::vector<tri::VertexId> vertices = delaunay_.build(places);
  std::vector<std::uint32_t> order(samples.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return slot(vertices[a]) < slot(vertices[b]);
  });
  heights_.resize(delaunay_.vertex_slots());
  std::vector<double> group;
  for (std::size_t i = 0; i < order.size(); ++i) {
    group.push_back(samples.z[order[i]]);
    const tri::VertexId vertex = vertices[order[i]];
    if (i + 1 < order.size() && vertices[order[i + 1]] == vertex) continue;
    heights_[slot(vertex)] = merged_height(group, duplicates);
    group.clear();
  }
}

std::optional<double> LocalSurface::height(const Point2& place) const {
  const tri::Location found = delaunay_.locate(place);
  if (found.place == tri::Place::kVertex) return heights_[slot(found.vertex)];
  if (found.place == tri::Place::kOutside) return std::nullopt;
  const auto corners = delaunay_.vertices(found.triangle);
  const Point2 a = delaunay_.point(corners[0]);
  const Point2 b = delaunay_.point(corners[1]);
  const Point2 c = delaunay_.point(corners[2]);
  const double bx = b[0] - a[0], by = b[1] - a[1], cx = c[0] - a[0], cy = c[1] - a[1];
  const double px = place[0] - a[0], py = place[1] - a[1];
  const double area = bx * cy - by * cx;
  const double first = heights_[slot(corners[0])];
  if (!(area > 0.0)) return first;  // thinner than doubles tell
  const double u = std::clamp((px * cy - py * cx) / area, 0.0, 1.0);
  const double v = std::clamp((bx * py - by * px) / area, 0.0, 1.0);
  return first + u * (heights_[slot(corners[1])] - first) +
         v * (heights_[slot(corners[2])] - first);
}

std::vector<ProfilePlace> LocalSurface::profile(unsigned axis, double c) const {
  std::vector<ProfilePlace> places;
  const unsigned along = 1 - axis;
  for (const tri::TriangleId t : delaunay_.all_triangles()) {
    const auto corners = delaunay_.vertices(t);
    const auto neighbours = delaunay_.neighbours(t);
    for (std::size_t i = 0; i < 3; ++i) {
      // Each edge once.
      if (neighbours[i] != tri::kNoTriangle && slot(neighbours[i]) < slot(t)) continue;
      tri::VertexId low = corners[(i + 1) % 3], high = corners[(i + 2) % 3];
      if (delaunay_.point(low)[axis] > delaunay_.point(high)[axis]) std::swap(low, high);
      const Point2 a = delaunay_.point(low), b = delaunay_.point(high);
      if (!(a[axis] < c && c <= b[axis])) continue;
      const double za = heights_[slot(low)], zb = heights_[slot(high)];
      if (b[axis] == c) {
        places.push_back({b[along], zb, true});
        continue;
      }
      const double part = (c - a[axis]) / (b[axis] - a[axis]);
      places.push_back({a[along] + (b[along] - a[along]) * part, za + (zb - za) * part, false});
    }
  }
  std::sort(places.begin(), places.end(), [](const ProfilePlace& p, const ProfilePlace& q) {
    if (p.at != q.at) return p.at < q.at;
    return p.sample != q.sample ? p.sample : p.height < q.height;
  });
  const auto same = [](const ProfilePlace& p, const ProfilePlace& q) { return p.at == q.at; };
  places.erase(std::unique(places.begin(), places.end(), same), places.end());
  return places;
}

}  // namespace terrace::terrain
