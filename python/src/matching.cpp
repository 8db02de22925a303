// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>
#include <vector>

#include <terrace/matching/assignment.hpp>
#include <terrace/matching/halving.hpp>
#include <terrace/matching/large_matching.hpp>
#include <terrace/matching/matching.hpp>
#include <terrace/matching/point_assignment.hpp>
#include <terrace/matching/sparse_assignment.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "names.hpp"

namespace terrace::python {
namespace {

/// Returns (column of each row or -1, cost, row duals, column duals).
template <class Number>
py::tuple arrays_of_assignment(matching::BasicAssignment<Number>&& result) {
  return py::make_tuple(mark_missing(result.column, matching::kUnassigned), result.cost,
                        to_array(std::move(result.row_dual)),
                        to_array(std::move(result.column_dual)));
}

template <class T>
py::tuple assign(const py::array_t<T, py::array::c_style>& costs) {
  if (costs.ndim() != 2) throw py::value_error("costs must have two dimensions");
  const auto rows = static_cast<std::size_t>(costs.shape(0));
  const auto columns = static_cast<std::size_t>(costs.shape(1));
  const std::span<const T> all(costs.data(), rows * columns);
  return arrays_of_assignment(released([&](const std::stop_token& stop) {
    return matching::assign(all, rows, columns, stop_check(stop));
  }));
}

/// row_of(i) returns the costs of row i. The matrix is never stored.
py::tuple assign_rows(std::size_t rows, std::size_t columns, const py::function& row_of) {
  return arrays_of_assignment(released([&](const std::stop_token& stop) {
    return matching::assign_rows(rows, columns, [&](std::size_t row, std::span<double> costs) {
      const py::gil_scoped_acquire gil;
      // Only Ctrl-C requests a stop, and it is raised instead of this.
      if (stop.stop_requested()) throw py::value_error("stopped");
      const auto input = Array<double>(row_of(row));
      const auto numbers = numbers_of(input, "a row of costs");
      if (numbers.size() != costs.size()) {
        throw py::value_error("row " + std::to_string(row) + " has " +
                              std::to_string(numbers.size()) + " costs for " +
                              std::to_string(costs.size()) + " columns");
      }
      std::copy(numbers.begin(), numbers.end(), costs.begin());
    });
  }));
}

template <std::size_t N>
py::tuple assign_places(const Array<double>& a, const Array<double>& b) {
  const auto rows = rows_of<N>(a, "a"), columns = rows_of<N>(b, "b");
  return arrays_of_assignment(released([&](const std::stop_token& stop) {
    return matching::assign_points(rows, columns, stop_check(stop));
  }));
}

/// Returns (mate of each point or -1, cost, bound, optimal).
template <std::size_t N>
py::tuple match(const Array<double>& array, const Array<std::uint32_t>& labels,
                std::size_t exact_limit, std::size_t window, unsigned rounds, double tolerance,
                unsigned threads) {
  const auto points = rows_of<N>(array, "points");
  matching::LargeMatchingOptions options;
  options.exact_limit = exact_limit;
  options.labels = numbers_of(labels, "labels");
  options.tolerance = tolerance;
  options.window = window;
  options.rounds = rounds;
  options.threads = all_or(threads);
  matching::LargeMatching result = released([&](const std::stop_token& stop) {
    options.check_stop = stop_check(stop);
    return match_large(points, options);
  });
  return py::make_tuple(mark_missing(result.mate, matching::kNone), result.cost, result.dual_bound,
                        result.optimal);
}

/// Returns (mates, cost, number of iterations, rows of iteration and cost for each improvement).
/// distances: whether `input` is a matrix of distances instead of points.
py::tuple match_by_halving(const Array<double>& input, bool distances, const std::string& method,
                           std::uint64_t iterations, double seconds, std::uint64_t seed,
                           unsigned threads) {
  matching::HalvingOptions options;
  options.method = named<matching::Halving>(method);
  options.iterations = iterations;
  options.seconds = seconds;
  options.seed = seed;
  options.threads = all_or(threads);
  std::vector<std::array<double, 3>> points;
  if (!distances) {
    points = points3_of(input);
  } else if (input.ndim() != 2 || input.shape(0) != input.shape(1)) {
    throw py::value_error("distances must have the shape (n, n)");
  }
  const auto count = static_cast<std::size_t>(input.shape(0));
  const double* const matrix = input.data();
  std::vector<std::array<double, 2>> steps;
  matching::HalvingMatching solution = released([&](const std::stop_token& stop) {
    options.check_stop = stop_check(stop);
    options.progress = [&](auto...) { return !stop.stop_requested(); };
    matching::HalvingMatching result =
        distances
            ? matching::match_by_halving(
                  count, [&](std::uint32_t i, std::uint32_t j) { return matrix[i * count + j]; },
                  options)
            : matching::match_by_halving(points, options);
    for (const auto& step : result.steps) {
      steps.push_back({static_cast<double>(step.iteration), step.cost});
    }
    return result;
  });
  return py::make_tuple(mark_missing(solution.mate, matching::kNone), solution.cost,
                        solution.iterations, to_array(std::move(steps)));
}

/// Assigns rows to columns; the costs are compressed rows.
py::tuple assign_sparse(const Array<std::uint64_t>& begin, const Array<std::uint32_t>& column,
                        const Array<double>& cost, std::size_t columns) {
  const auto offsets = numbers_of(begin, "offsets of rows");
  const std::vector<std::size_t> starts(offsets.begin(), offsets.end());
  const matching::SparseCosts costs{.columns = columns,
                                    .begin = starts,
                                    .column = numbers_of(column, "columns"),
                                    .cost = numbers_of(cost, "costs")};
  return arrays_of_assignment(released([&](const std::stop_token& stop) {
    return matching::assign_sparse(costs, stop_check(stop));
  }));
}

/// Matches the vertices of a graph. Returns the same as match().
py::tuple match_edges(std::size_t vertices, const Array<std::uint32_t>& ends,
                      const Array<double>& weights) {
  const auto pairs = rows_of<2>(ends, "edges");
  const auto costs = numbers_of(weights, "weights");
  if (pairs.size() != costs.size()) {
    throw py::value_error("there are " + std::to_string(costs.size()) + " weights for " +
                          std::to_string(pairs.size()) + " edges");
  }
  double bound = 0;
  const matching::Matching solution = released([&](const std::stop_token& stop) {
    std::vector<matching::WeightedEdge> edges;
    edges.reserve(pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      edges.push_back({pairs[i][0], pairs[i][1], costs[i]});
    }
    matching::Matching result =
        matching::min_weight_perfect_matching(vertices, edges, stop_check(stop));
    bound = result.dual_bound();
    return result;
  });
  return py::make_tuple(mark_missing(solution.mate, matching::kNone), solution.cost, bound, true);
}

}  // namespace

void bind_matching(py::module_& module) {
  module.def("assign", &assign<double>, py::arg().noconvert());
  module.def("assign", &assign<float>, py::arg().noconvert());
  module.def("assign", &assign<std::int32_t>, py::arg().noconvert());
  module.def("assign_rows", &assign_rows);
  module.def("assign_sparse", &assign_sparse);
  module.def("match_by_halving", &match_by_halving);
  module.def("match_edges", &match_edges);
  module.def("assign_points", [](const Array<double>& a, const Array<double>& b) {
    return a.ndim() == 2 && a.shape(1) == 3 ? assign_places<3>(a, b) : assign_places<2>(a, b);
  });
  module.def("match_points2", &match<2>);
  module.def("match_points3", &match<3>);
}

}  // namespace terrace::python
