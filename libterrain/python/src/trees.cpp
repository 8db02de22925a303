// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/matching/matching_tree.hpp>
#include <terrace/matching/point_hierarchy.hpp>
#include <terrace/matching/triangle_hierarchy.hpp>

#include "arrays.hpp"
#include "call.hpp"

namespace terrace::python {
namespace {

/// (rows a, b, distance, size; the level of each row; positions of the rows' nodes)
template <std::size_t N>
py::tuple tree_of(const Array<double>& given, const Array<double>& weights,
                  const Array<std::uint32_t>& labels, unsigned threads) {
  const auto points = rows_of<N>(given, "points");
  matching::MatchingTreeOptions<std::array<double, N>> options;
  options.weights = numbers_of(weights, "weights");
  options.labels = numbers_of(labels, "labels");
  options.threads = threads;
  std::vector<std::array<double, 4>> rows;
  std::vector<std::uint32_t> levels;
  auto made = released([&] {
    auto tree = make_matching_tree(points, options);
    rows.reserve(tree.rows.size());
    levels.reserve(tree.rows.size());
    for (const matching::MatchingTreeRow& row : tree.rows) {
      rows.push_back({static_cast<double>(row.a), static_cast<double>(row.b), row.distance,
                      static_cast<double>(row.size)});
      levels.push_back(row.level);
    }
    return tree;
  });
  return py::make_tuple(to_array(std::move(rows)), to_array(std::move(levels)),
                        to_array(std::move(made.positions)));
}

/// Rows of numbers of nodes; any linkage's first two columns.
std::vector<matching::TreeChildren> children_of(const Array<double>& given) {
  std::vector<matching::TreeChildren> children;
  for (const auto& [a, b] : rows_of<2>(given, "the tree")) {
    constexpr double kMost = std::numeric_limits<std::uint32_t>::max();
    if (!(a >= 0 && a <= kMost && b >= 0 && b <= kMost)) {
      throw py::value_error("row " + std::to_string(children.size()) + " of the tree is none");
    }
    children.push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)});
  }
  return children;
}

/// Numbers and distances of what queries have found, -1 and infinity for nothing.
struct Found {
  explicit Found(std::size_t count)
      : indices(count, std::int64_t{-1}),
        distances(count, std::numeric_limits<double>::infinity()) {}
  template <class Item>
  void set(std::size_t at, const Item& item, double distance) {
    indices[at] = item.index;
    distances[at] = distance;
  }
  py::tuple arrays() && {
    return py::make_tuple(to_array(std::move(indices)), to_array(std::move(distances)));
  }
  std::vector<std::int64_t> indices;
  std::vector<double> distances;
};

/// The k nearest of each place, row by row.
template <std::size_t N>
py::tuple nearest_points(const matching::PointHierarchy<N>& tree, const Array<double>& places,
                         std::size_t k) {
  const auto asked = rows_of<N>(places, "places");
  Found found(asked.size() * k);
  released([&] {
    std::vector<matching::Neighbour> near;
    for (std::size_t i = 0; i < asked.size(); ++i) {
      tree.nearest(asked[i], k, near);
      for (std::size_t j = 0; j < near.size(); ++j) found.set(i * k + j, near[j], near[j].distance);
    }
  });
  return std::move(found).arrays();
}

/// hit(ray) of each ray: (number or -1, t or infinity).
template <class Hit>
py::tuple first_hits(const Array<double>& origins, const Array<double>& directions, Hit&& hit) {
  const auto from = rows_of<3>(origins, "origins"), towards = rows_of<3>(directions, "directions");
  if (from.size() != towards.size()) {
    throw py::value_error("there are " + std::to_string(from.size()) + " origins and " +
                          std::to_string(towards.size()) + " directions");
  }
  Found found(from.size());
  released([&] {
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (const auto first = hit(matching::Ray{from[i], towards[i]}))
        found.set(i, *first, first->t);
    }
  });
  return std::move(found).arrays();
}

template <std::size_t N>
auto bind_points(py::module_& module, const char* name) {
  using Tree = matching::PointHierarchy<N>;
  return py::class_<Tree>(module, name)
      .def(py::init([](const Array<double>& rows, const Array<double>& given) {
        const auto children = children_of(rows);
        const auto points = rows_of<N>(given, "points");
        return released([&] { return std::make_unique<Tree>(children, points); });
      }))
      .def("nearest", &nearest_points<N>)
      .def("cost", [](const Tree& tree) { return tree.tree().surface_area_cost(); })
      .def("depth", [](const Tree& tree) { return tree.tree().depth(); });
}

std::vector<matching::Triangle> triangles_of(const Array<std::uint32_t>& given) {
  const auto rows = rows_of<3>(given, "triangles");
  return {rows.begin(), rows.end()};
}

}  // namespace

void bind_trees(py::module_& module) {
  module.def("matching_tree", [](const Array<double>& points, const Array<double>& weights,
                                 const Array<std::uint32_t>& labels, unsigned threads) {
    return points.ndim() == 2 && points.shape(1) == 3
               ? tree_of<3>(points, weights, labels, threads)
               : tree_of<2>(points, weights, labels, threads);
  });
  module.def("centroids", [](const Array<double>& corners, const Array<std::uint32_t>& triangles) {
    return to_array(matching::centroids(rows_of<3>(corners, "vertices"), triangles_of(triangles)));
  });
  bind_points<2>(module, "PointTree2");
  bind_points<3>(module, "PointTree3")
      .def("hit", [](const matching::PointHierarchy<3>& tree, const Array<double>& origins,
                     const Array<double>& directions, double radius) {
        return first_hits(origins, directions,
                          [&](const matching::Ray& ray) { return tree.hit(ray, radius); });
      });
  using Triangles = matching::TriangleHierarchy;
  py::class_<Triangles>(module, "TriangleTree")
      .def(py::init([](const Array<double>& rows, const Array<double>& corners,
                       const Array<std::uint32_t>& given) {
        const auto children = children_of(rows);
        const auto places = rows_of<3>(corners, "vertices");
        const auto triangles = triangles_of(given);
        return released([&] { return std::make_unique<Triangles>(children, places, triangles); });
      }))
      .def("nearest",
           [](const Triangles& tree, const Array<double>& places) {
             const auto asked = rows_of<3>(places, "places");
             Found found(asked.size());
             released([&] {
               for (std::size_t i = 0; i < asked.size(); ++i) {
                 if (const auto near = tree.nearest(asked[i])) found.set(i, *near, near->distance);
               }
             });
             return std::move(found).arrays();
           })
      .def(
          "hit",
          [](const Triangles& tree, const Array<double>& origins, const Array<double>& directions) {
            return first_hits(origins, directions,
                              [&](const matching::Ray& ray) { return tree.hit(ray); });
          })
      .def("cost", [](const Triangles& tree) { return tree.tree().surface_area_cost(); })
      .def("depth", [](const Triangles& tree) { return tree.tree().depth(); });
}

}  // namespace terrace::python
