// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <terrace/matching/assignment.hpp>
#include <terrace/matching/large_matching.hpp>
#include <terrace/matching/matching.hpp>
#include <terrace/matching/point_assignment.hpp>
#include <terrace/matching/sparse_assignment.hpp>

#include "arrays.hpp"
#include "call.hpp"

namespace terrace::python {
namespace {

/// (column of each row or -1, cost, row duals, column duals)
template <class Number>
py::tuple arrays_of_assignment(matching::BasicAssignment<Number>&& made) {
  return py::make_tuple(with_nobody(made.column, matching::kUnassigned), made.cost,
                        to_array(std::move(made.row_dual)), to_array(std::move(made.column_dual)));
}

template <class T>
py::tuple assign(const py::array_t<T, py::array::c_style>& costs) {
  if (costs.ndim() != 2) throw py::value_error("costs must have two dimensions");
  const auto rows = static_cast<std::size_t>(costs.shape(0));
  const auto columns = static_cast<std::size_t>(costs.shape(1));
  const std::span<const T> all(costs.data(), rows * columns);
  return arrays_of_assignment(released([&] { return matching::assign(all, rows, columns); }));
}

template <std::size_t N>
py::tuple assign_places(const Array<double>& a, const Array<double>& b) {
  const auto rows = rows_of<N>(a, "a"), columns = rows_of<N>(b, "b");
  return arrays_of_assignment(released([&] { return matching::assign_points(rows, columns); }));
}

/// (mate of each point or -1, cost, bound, optimal)
template <std::size_t N>
py::tuple match(const Array<double>& given, std::size_t exact_limit, std::size_t window,
                unsigned rounds, unsigned threads) {
  const auto points = rows_of<N>(given, "points");
  matching::LargeMatchingOptions options;
  options.exact_limit = exact_limit;
  options.window = window;
  options.rounds = rounds;
  options.threads = threads > 0 ? threads : std::max(1U, std::thread::hardware_concurrency());
  matching::LargeMatching made = released([&] { return match_large(points, options); });
  return py::make_tuple(with_nobody(made.mate, matching::kNobody), made.cost, made.dual_bound,
                        made.optimal);
}

/// Compressed rows; the same.
py::tuple assign_sparse(const Array<std::uint64_t>& begin, const Array<std::uint32_t>& column,
                        const Array<double>& cost, std::size_t columns) {
  const auto offsets = numbers_of(begin, "offsets of rows");
  const std::vector<std::size_t> starts(offsets.begin(), offsets.end());
  const matching::SparseCosts costs{.columns = columns,
                                    .begin = starts,
                                    .column = numbers_of(column, "columns"),
                                    .cost = numbers_of(cost, "costs")};
  return arrays_of_assignment(released([&] { return matching::assign_sparse(costs); }));
}

/// As match(), of a graph.
py::tuple match_edges(std::size_t vertices, const Array<std::uint32_t>& ends,
                      const Array<double>& weights) {
  const auto pairs = rows_of<2>(ends, "edges");
  const auto costs = numbers_of(weights, "weights");
  if (pairs.size() != costs.size()) {
    throw py::value_error("there are " + std::to_string(costs.size()) + " weights of " +
                          std::to_string(pairs.size()) + " edges");
  }
  double bound = 0;
  const matching::Matching made = released([&] {
    std::vector<matching::WeightedEdge> edges;
    edges.reserve(pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      edges.push_back({pairs[i][0], pairs[i][1], costs[i]});
    }
    matching::Matching result = matching::min_weight_perfect_matching(vertices, edges);
    bound = result.dual_bound();
    return result;
  });
  return py::make_tuple(with_nobody(made.mate, matching::kNobody), made.cost, bound, true);
}

}  // namespace

void bind_matching(py::module_& module) {
  module.def("assign", &assign<double>, py::arg().noconvert());
  module.def("assign", &assign<float>, py::arg().noconvert());
  module.def("assign", &assign<std::int32_t>, py::arg().noconvert());
  module.def("assign_sparse", &assign_sparse);
  module.def("match_edges", &match_edges);
  module.def("assign_points", [](const Array<double>& a, const Array<double>& b) {
    return a.ndim() == 2 && a.shape(1) == 3 ? assign_places<3>(a, b) : assign_places<2>(a, b);
  });
  module.def("match_points", [](const Array<double>& points, std::size_t exact_limit,
                                std::size_t window, unsigned rounds, unsigned threads) {
    return points.ndim() == 2 && points.shape(1) == 3
               ? match<3>(points, exact_limit, window, rounds, threads)
               : match<2>(points, exact_limit, window, rounds, threads);
  });
}

}  // namespace terrace::python
