// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>
#include <terrace/tri/multiresolution.hpp>

#include "terrace/terrain/detail.hpp"

namespace terrace::terrain {

/// The triangulation of the points in wanted clusters that meet a view's condition. Has the
/// interface of a tri::Multiresolution2, which would contain all points of its clusters.
template <class Coord>
class MatchingPoints {
 public:
  /// Throws: stream::Error on a damaged store; stream::Stopped.
  MatchingPoints(const stream::Store& view, const Detail& detail) {
    std::vector<std::array<Coord, 2>> places;
    std::vector<Vertex> points;
    for_each_wanted(
        view, detail,
        [&](stream::ClusterId id, const stream::ClusterRecord&, const stream::ClusterPoints& of) {
          for (std::uint32_t i = 0; i < of.size(); ++i) {
            if (!of.match(i)) continue;
            const stream::Point3& p = of.positions[i];
            places.push_back({static_cast<Coord>(p[0]), static_cast<Coord>(p[1])});
            points.push_back({{id, i}, p[2]});
          }
        });
    triangulation_.set_check_stop([&] { view.check_stop(); });
    const std::vector<tri::VertexId> vertices = triangulation_.build(places);
    triangulation_.set_check_stop({});
    vertices_.resize(triangulation_.vertex_slots());
    // In reverse, so that the first of several points at one place wins.
    for (std::size_t i = points.size(); i-- > 0;) vertices_[tri::slot(vertices[i])] = points[i];
  }

  [[nodiscard]] const tri::Delaunay2<Coord>& triangulation() const { return triangulation_; }
  [[nodiscard]] tri::PointId point_id(tri::VertexId v) const {
    return vertices_[tri::slot(v)].point;
  }
  [[nodiscard]] unsigned level(tri::VertexId v) const { return level_of(point_id(v).cluster); }
  [[nodiscard]] double height(tri::VertexId v) const { return vertices_[tri::slot(v)].height; }

 private:
  struct Vertex {
    tri::PointId point{};
    double height = 0.0;
  };

  tri::Delaunay2<Coord> triangulation_;
  std::vector<Vertex> vertices_;  ///< by vertex slot
};

}  // namespace terrace::terrain
