// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "terrace/tri/shape.hpp"
#include "triangle_distance.hpp"

namespace terrace::tri::shape {

/// Distances of points from a surface, by a tree of boxes around its faces. About 50 bytes per
/// face.
class SurfaceDistance {
 public:
  /// The points must outlive the object. O(n log n).
  SurfaceDistance(const std::vector<Vector3>& points,
                  const std::vector<std::array<std::uint32_t, 3>>& faces)
      : points_(&points), faces_(faces) {
    nodes_.reserve(faces_.size() + 1);  // a leaf has at least two faces unless it is the root
    if (!faces_.empty()) add_node(0, static_cast<std::uint32_t>(faces_.size()));
  }

  /// The squared distance from the nearest face, or `limit` if that is not less. Usually O(log n).
  [[nodiscard]] double square(const Vector3& point, double limit) const {
    std::uint32_t near = 0;
    return square(point, limit, 0.0, near);
  }
  /// The same, except that any number up to `enough` may be returned if the squared distance is at
  /// most `enough`. That is much faster, above all if `near`, a face of the tree, is near the
  /// point. Replaces it by a face that determined the distance, for the next point. Start with 0.
  [[nodiscard]] double square(const Vector3& point, double limit, double enough,
                              std::uint32_t& near) const {
    if (faces_.empty() || limit <= enough) return limit;
    limit = std::min(limit, square_from(faces_[near], point));
    if (limit > enough) visit(0, point, enough, limit, near);
    return limit;
  }

 private:
  static constexpr std::uint32_t kLeafFaces = 4;

  /// A node is followed by its first child.
  struct Node {
    Box3 box;
    std::uint32_t begin = 0;  ///< the first face of a leaf, otherwise the second child
    std::uint32_t end = 0;    ///< after the last face of a leaf, otherwise 0
  };

  std::uint32_t add_node(std::uint32_t begin, std::uint32_t end) {
    const auto at = static_cast<std::uint32_t>(nodes_.size());
    Box3 box;
    for (std::uint32_t f = begin; f < end; ++f) {
      for (const std::uint32_t v : faces_[f]) box.include((*points_)[v]);
    }
    nodes_.push_back({box, begin, end});
    if (end - begin <= kLeafFaces) return at;
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k) {
      if (box.max[k] - box.min[k] > box.max[axis] - box.min[axis]) axis = k;
    }
    const auto middle = begin + (end - begin) / 2;
    const auto sum = [&](const std::array<std::uint32_t, 3>& face) {
      return (*points_)[face[0]][axis] + (*points_)[face[1]][axis] + (*points_)[face[2]][axis];
    };
    std::nth_element(faces_.begin() + begin, faces_.begin() + middle, faces_.begin() + end,
                     [&](const auto& a, const auto& b) {
                       const double x = sum(a), y = sum(b);
                       return x != y ? x < y : a < b;
                     });
    add_node(begin, middle);
    const std::uint32_t second = add_node(middle, end);
    nodes_[at].begin = second;
    nodes_[at].end = 0;
    return at;
  }

  [[nodiscard]] static double square_from(const Box3& box, const Vector3& point) {
    double sum = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double outside = std::max({box.min[k] - point[k], 0.0, point[k] - box.max[k]});
      sum += outside * outside;
    }
    return sum;
  }

  [[nodiscard]] double square_from(const std::array<std::uint32_t, 3>& face,
                                   const Vector3& point) const {
    const auto& [a, b, c] = face;
    return TriangleDistance((*points_)[a], (*points_)[b], (*points_)[c]).square(point);
  }

  void visit(std::uint32_t at, const Vector3& point, double enough, double& least,
             std::uint32_t& near) const {
    const Node& node = nodes_[at];
    if (node.end != 0) {
      for (std::uint32_t f = node.begin; f < node.end; ++f) {
        const double square = square_from(faces_[f], point);
        if (!(square < least)) continue;
        least = square;
        near = f;
      }
      return;
    }
    std::array<std::uint32_t, 2> children{at + 1, node.begin};
    std::array<double, 2> squares{square_from(nodes_[children[0]].box, point),
                                  square_from(nodes_[children[1]].box, point)};
    if (squares[1] < squares[0]) {
      std::swap(children[0], children[1]);
      std::swap(squares[0], squares[1]);
    }
    if (squares[0] < least) visit(children[0], point, enough, least, near);
    if (squares[1] < least && least > enough) visit(children[1], point, enough, least, near);
  }

  const std::vector<Vector3>* points_;
  std::vector<std::array<std::uint32_t, 3>> faces_;
  std::vector<Node> nodes_;
};

}  // namespace terrace::tri::shape
