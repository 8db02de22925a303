// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/cluster/dendrogram.hpp>
#include <terrace/cluster/facility_location.hpp>
#include <terrace/cluster/k_means.hpp>
#include <terrace/cluster/k_median.hpp>
#include <terrace/cluster/linkage.hpp>
#include <terrace/terrain/metric_choice.hpp>

#include "arrays.hpp"
#include "call.hpp"

namespace terrace::python {
namespace {

unsigned all_or(unsigned threads) {
  return threads > 0 ? threads : std::max(1U, std::thread::hardware_concurrency());
}

/// Points of the plane get z = 0.
std::vector<cluster::Point3> points_of(const Array<double>& given) {
  if (given.ndim() == 2 && given.shape(1) == 2) {
    std::vector<cluster::Point3> points;
    points.reserve(static_cast<std::size_t>(given.shape(0)));
    for (const auto& p : rows_of<2>(given, "points")) points.push_back({p[0], p[1], 0});
    return points;
  }
  if (given.ndim() != 2 || given.shape(1) != 3) {
    throw py::value_error("points must have the shape (n, 2) or (n, 3)");
  }
  const auto rows = rows_of<3>(given, "points");
  return {rows.begin(), rows.end()};
}

/// Rows a, b, height, size.
std::vector<std::array<double, 4>> rows_of_merges(const cluster::Dendrogram& made) {
  std::vector<std::array<double, 4>> rows;
  rows.reserve(made.merges.size());
  for (const cluster::Merge& merge : made.merges) {
    rows.push_back({static_cast<double>(merge.a), static_cast<double>(merge.b), merge.height,
                    static_cast<double>(merge.size)});
  }
  return rows;
}

py::array linkage(const Array<double>& given, const std::string& method, unsigned threads) {
  const std::vector<cluster::Point3> points = points_of(given);
  const bool single = named<bool>(method, "method", {{"single", true}, {"complete", false}});
  const cluster::LinkageOptions options{.threads = all_or(threads)};
  return to_array(released([&] {
    return rows_of_merges(
        single ? cluster::single_linkage(points, options)
               : cluster::complete_linkage(std::span<const cluster::Point3>(points), options));
  }));
}

/// distances: of all pairs i < j of `count` things, by i, then j.
py::array linkage_of_distances(std::size_t count, const Array<double>& given, unsigned threads) {
  const auto distances = numbers_of(given, "distances");
  if (count == 0 || count > cluster::kMostDendrogramPoints ||
      distances.size() != count * (count - 1) / 2) {
    throw py::value_error("there are not as many distances as pairs");
  }
  const auto of_pair = [&](std::uint32_t i, std::uint32_t j) {
    return distances[i * (2 * count - i - 1) / 2 + (j - i - 1)];
  };
  const cluster::LinkageOptions options{.threads = all_or(threads)};
  return to_array(
      released([&] { return rows_of_merges(complete_linkage(count, of_pair, options)); }));
}

/// (ends of each edge, lengths)
py::tuple spanning_tree(const Array<double>& given, unsigned threads) {
  const std::vector<cluster::Point3> points = points_of(given);
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<double> lengths;
  released([&] {
    for (const cluster::Link& link : cluster::spanning_tree(points, {.threads = all_or(threads)})) {
      edges.push_back({link.i, link.j});
      lengths.push_back(link.height);
    }
  });
  return py::make_tuple(to_array(std::move(edges)), to_array(std::move(lengths)));
}

py::array cut(const Array<double>& given, std::optional<std::size_t> count,
              std::optional<double> height) {
  const auto rows = rows_of<4>(given, "the linkage");
  return to_array(released([&] {
    cluster::Dendrogram dendrogram{.points = rows.size() + 1, .merges = {}};
    dendrogram.merges.reserve(rows.size());
    const double most = 2.0 * static_cast<double>(rows.size()) + 1;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (const std::size_t column : std::initializer_list<std::size_t>{0, 1, 3}) {
        if (rows[i][column] >= 0 && rows[i][column] <= most) continue;
        throw std::invalid_argument("row " + std::to_string(i) + " of the linkage is none");
      }
      dendrogram.merges.push_back({static_cast<std::uint32_t>(rows[i][0]),
                                   static_cast<std::uint32_t>(rows[i][1]), rows[i][2],
                                   static_cast<std::uint32_t>(rows[i][3])});
    }
    if (const std::string fault = dendrogram_fault(dendrogram); !fault.empty()) {
      throw std::invalid_argument(fault);
    }
    return count ? cut_count(dendrogram, *count) : cut_height(dendrogram, height.value());
  }));
}

/// (centres, labels, sse, iterations, converged)
py::tuple k_means(const Array<double>& given, const py::object& start, std::size_t clusters,
                  const Array<double>& weights, std::uint64_t seed, std::size_t restarts,
                  std::size_t max_iterations, double tolerance, unsigned threads) {
  const std::vector<cluster::Point3> points = points_of(given);
  std::vector<cluster::Point3> centres;
  if (!start.is_none()) centres = points_of(start.cast<Array<double>>());
  const auto weighing = numbers_of(weights, "weights");
  if (!weighing.empty() && weighing.size() != points.size()) {
    throw py::value_error("there are " + std::to_string(weighing.size()) + " weights of " +
                          std::to_string(points.size()) + " points");
  }
  const cluster::KMeansOptions options{.clusters = clusters,
                                       .seed = seed,
                                       .restarts = restarts,
                                       .max_iterations = max_iterations,
                                       .tolerance = tolerance,
                                       .threads = all_or(threads)};
  cluster::KMeansResult made = released([&] {
    return centres.empty() ? cluster::k_means(points, weighing, options)
                           : cluster::k_means_from(centres, points, weighing, options);
  });
  return py::make_tuple(to_array(std::move(made.centres)), to_array(std::move(made.assignment)),
                        made.sse, made.iterations, made.converged);
}

cluster::FacilityStrategy strategy_of(const std::string& name) {
  using cluster::FacilityStrategy;
  return named<FacilityStrategy>(name, "method",
                                 {{"fast", FacilityStrategy::fast},
                                  {"automatic", FacilityStrategy::automatic},
                                  {"full-scan", FacilityStrategy::full_scan},
                                  {"quadtree", FacilityStrategy::quadtree},
                                  {"octree", FacilityStrategy::octree},
                                  {"kd-tree", FacilityStrategy::kd_tree},
                                  {"facilities", FacilityStrategy::facilities},
                                  {"interchange", FacilityStrategy::interchange},
                                  {"jain-vazirani", FacilityStrategy::jain_vazirani},
                                  {"greedy-stars", FacilityStrategy::greedy_stars}});
}

cluster::Effort effort_named(const std::string& name) {
  using cluster::Effort;
  return named<Effort>(name, "effort",
                       {{"fast", Effort::fast},
                        {"default", Effort::standard},
                        {"fine", Effort::fine},
                        {"full", Effort::full}});
}

/// (facilities, labels, opening, connection and outlier cost, lower bound); -1: an outlier.
py::tuple arrays_of_solution(cluster::FacilitySolution&& made) {
  return py::make_tuple(to_array(std::move(made.facilities)),
                        with_nobody(made.assignment, cluster::kOutlier), made.opening_cost,
                        made.connection_cost, made.outlier_cost, made.lower_bound);
}

/// bound_steps: of a search for a better lower bound than the method's own; 0: none.
template <class Problem>
cluster::FacilitySolution with_bound(const Problem& problem, cluster::FacilitySolution&& made,
                                     std::size_t bound_steps, unsigned threads) {
  if (bound_steps > 0) {
    const double bound =
        cluster::lower_bound(problem, made, {.steps = bound_steps, .threads = threads}).lower_bound;
    made.lower_bound = std::max(made.lower_bound, bound);
  }
  return std::move(made);
}

/// count: exactly so many facilities, which cost nothing.
py::tuple facility_location(const Array<double>& given, double facility_cost,
                            std::optional<std::size_t> count, const std::string& method,
                            const std::string& effort, const std::string& metric,
                            const Array<double>& weights, double outlier_price, std::uint64_t seed,
                            std::size_t bound_steps, unsigned threads) {
  const std::vector<cluster::Point3> points = points_of(given);
  const cluster::FacilityPoints problem{
      .points = points,
      .weights = numbers_of(weights, "weights"),
      .metric = terrain::MetricChoice::parse(metric).on_ground({}, cluster::kIdentityMap),
      .facility_cost = facility_cost,
      .outlier_price = outlier_price};
  const cluster::FacilityOptions options{.strategy = strategy_of(method),
                                         .effort = effort_named(effort),
                                         .seed = seed,
                                         .threads = all_or(threads)};
  return arrays_of_solution(released([&] {
    if (!count) return with_bound(problem, solve(problem, options), bound_steps, options.threads);
    return k_median(problem, *count,
                    {.restarts = 1, .bound_steps = 0, .seed = seed, .threads = options.threads});
  }));
}

/// Costs of connecting a facility (row) with a client (column), and of opening each facility.
py::tuple facility_matrix(const Array<double>& connection, const Array<double>& opening,
                          std::optional<std::size_t> count, const std::string& method,
                          const std::string& effort, std::uint64_t seed, std::size_t bound_steps,
                          unsigned threads) {
  if (connection.ndim() != 2) throw py::value_error("connection costs have two dimensions");
  const cluster::FacilityMatrix problem{
      .facilities = static_cast<std::size_t>(connection.shape(0)),
      .clients = static_cast<std::size_t>(connection.shape(1)),
      .opening = numbers_of(opening, "opening costs"),
      .connection = {connection.data(), static_cast<std::size_t>(connection.size())}};
  const cluster::FacilityOptions options{.strategy = strategy_of(method),
                                         .effort = effort_named(effort),
                                         .seed = seed,
                                         .threads = all_or(threads)};
  return arrays_of_solution(released([&] {
    if (!count) return with_bound(problem, solve(problem, options), bound_steps, options.threads);
    return k_median(problem, *count,
                    {.bound_steps = static_cast<std::uint32_t>(std::min(
                         bound_steps, std::size_t{std::numeric_limits<std::uint32_t>::max()})),
                     .seed = seed,
                     .threads = options.threads});
  }));
}

}  // namespace

void bind_cluster(py::module_& module) {
  module.def("linkage", &linkage);
  module.def("linkage_of_distances", &linkage_of_distances);
  module.def("spanning_tree", &spanning_tree);
  module.def("cut", &cut);
  module.def("k_means", &k_means);
  module.def("facility_location", &facility_location);
  module.def("facility_matrix", &facility_matrix);
}

}  // namespace terrace::python
