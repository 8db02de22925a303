// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/base/stop_check.hpp>
#include <terrace/matching/matching_tree.hpp>
#include <terrace/matching/point_hierarchy.hpp>
#include <terrace/matching/triangle_hierarchy.hpp>

#include "arrays.hpp"
#include "call.hpp"

namespace terrace::python {
namespace {

/// Wraps a Python function from an array of positions to the partner of each position or -1.
template <class Point>
matching::LevelMatcher<Point> matcher_of(const py::object& value) {
  if (value.is_none()) return {};
  return [&value](std::span<const Point> nodes) {
    const py::gil_scoped_acquire gil;
    const Array<std::int64_t> mates(
        value(to_array(std::vector<Point>(nodes.begin(), nodes.end()))));
    std::vector<std::uint32_t> result;
    for (const std::int64_t mate : numbers_of(mates, "what `matcher` returns")) {
      if (mate < -1 || mate >= static_cast<std::int64_t>(nodes.size())) {
        throw py::value_error("`matcher` returns the partner " + std::to_string(mate) + " among " +
                              std::to_string(nodes.size()) + " points");
      }
      result.push_back(static_cast<std::uint32_t>(mate));
    }
    return result;
  };
}

/// Returns (rows of a, b, distance, size; the level of each row; the positions of the rows' nodes).
template <std::size_t N>
py::tuple tree_of(const Array<double>& input, const Array<double>& weights,
                  const Array<std::uint32_t>& labels, const py::object& matcher, unsigned threads) {
  const auto points = rows_of<N>(input, "points");
  matching::MatchingTreeOptions<std::array<double, N>> options;
  options.weights = numbers_of(weights, "weights");
  options.labels = numbers_of(labels, "labels");
  options.threads = threads;
  options.matcher = matcher_of<std::array<double, N>>(matcher);
  std::vector<std::array<double, 4>> rows;
  std::vector<std::uint32_t> levels;
  auto result = released([&](const std::stop_token& stop) {
    options.progress = [&](auto...) { return !stop.stop_requested(); };
    options.check_stop = stop_check(stop);
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
                        to_array(std::move(result.positions)));
}

/// Converts rows of two node numbers, such as the first two columns of a linkage.
std::vector<matching::TreeChildren> children_of(const Array<double>& array) {
  std::vector<matching::TreeChildren> children;
  for (const auto& [a, b] : rows_of<2>(array, "the tree")) {
    constexpr double kMost = std::numeric_limits<std::uint32_t>::max();
    if (!(a >= 0 && a <= kMost && b >= 0 && b <= kMost)) {
      throw py::value_error("row " + std::to_string(children.size()) +
                            " of the tree has an invalid number");
    }
    children.push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)});
  }
  return children;
}

/// Returns the children of each row after rotations. lower, upper: corners of the leaves' boxes.
template <std::size_t N>
py::array rotated(const Array<double>& rows, const Array<double>& lower, const Array<double>& upper,
                  unsigned passes) {
  const std::vector<matching::TreeChildren> children = children_of(rows);
  const auto low = rows_of<N>(lower, "lower"), high = rows_of<N>(upper, "upper");
  if (low.size() != high.size()) {
    throw py::value_error("there are " + std::to_string(low.size()) + " lower and " +
                          std::to_string(high.size()) + " upper corners");
  }
  return to_array(released([&] {
    std::vector<base::Box<N>> boxes;
    for (std::size_t i = 0; i < low.size(); ++i) boxes.push_back({low[i], high[i]});
    std::vector<std::array<std::uint32_t, 2>> result;
    const std::span<const base::Box<N>> all(boxes);
    for (const auto& [a, b] : matching::rotate_tree<N>(children, all, passes)) {
      result.push_back({a, b});
    }
    return result;
  }));
}

/// See base::StopTicks.
constexpr std::size_t kTicksOfQuery = 4096;

/// Indices and distances of the items found, -1 and infinity for none.
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

/// Returns the k points nearest to each place, row by row.
template <std::size_t N>
py::tuple nearest_points(const matching::PointHierarchy<N>& tree, const Array<double>& places,
                         std::size_t k) {
  const auto queries = rows_of<N>(places, "places");
  Found found(queries.size() * k);
  released([&](const std::stop_token& stop) {
    base::StopTicks ticks(stop_check(stop));
    std::vector<matching::Neighbour> near;
    for (std::size_t i = 0; i < queries.size(); ++i) {
      ticks(kTicksOfQuery);
      tree.nearest(queries[i], k, near);
      for (std::size_t j = 0; j < near.size(); ++j) found.set(i * k + j, near[j], near[j].distance);
    }
  });
  return std::move(found).arrays();
}

/// Returns hit(ray) for each ray: (index or -1, t or infinity).
template <class Hit>
py::tuple first_hits(const Array<double>& origins, const Array<double>& directions, Hit&& hit) {
  const auto from = rows_of<3>(origins, "origins"), towards = rows_of<3>(directions, "directions");
  if (from.size() != towards.size()) {
    throw py::value_error("there are " + std::to_string(from.size()) + " origins and " +
                          std::to_string(towards.size()) + " directions");
  }
  Found found(from.size());
  released([&](const std::stop_token& stop) {
    base::StopTicks ticks(stop_check(stop));
    for (std::size_t i = 0; i < from.size(); ++i) {
      ticks(kTicksOfQuery);
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
      .def(py::init([](const Array<double>& rows, const Array<double>& array) {
        const auto children = children_of(rows);
        const auto points = rows_of<N>(array, "points");
        return released([&] { return std::make_unique<Tree>(children, points); });
      }))
      .def("nearest", &nearest_points<N>)
      .def("cost", [](const Tree& tree) { return tree.tree().surface_area_cost(); })
      .def("depth", [](const Tree& tree) { return tree.tree().depth(); });
}

std::vector<matching::Triangle> triangles_of(const Array<std::uint32_t>& array) {
  const auto rows = rows_of<3>(array, "triangles");
  return {rows.begin(), rows.end()};
}

}  // namespace

void bind_trees(py::module_& module) {
  module.def("matching_tree2", &tree_of<2>);
  module.def("matching_tree3", &tree_of<3>);
  module.def("rotate_tree2", &rotated<2>);
  module.def("rotate_tree3", &rotated<3>);
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
                       const Array<std::uint32_t>& array) {
        const auto children = children_of(rows);
        const auto places = rows_of<3>(corners, "vertices");
        const auto triangles = triangles_of(array);
        return released([&] { return std::make_unique<Triangles>(children, places, triangles); });
      }))
      .def("nearest",
           [](const Triangles& tree, const Array<double>& places) {
             const auto queries = rows_of<3>(places, "places");
             Found found(queries.size());
             released([&](const std::stop_token& stop) {
               base::StopTicks ticks(stop_check(stop));
               for (std::size_t i = 0; i < queries.size(); ++i) {
                 ticks(kTicksOfQuery);
                 if (const auto near = tree.nearest(queries[i]))
                   found.set(i, *near, near->distance);
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
