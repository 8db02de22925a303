// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/cluster/dendrogram.hpp>
#include <terrace/cluster/facility_location.hpp>
#include <terrace/cluster/hierarchy.hpp>
#include <terrace/cluster/k_means.hpp>
#include <terrace/cluster/k_median.hpp>
#include <terrace/cluster/linkage.hpp>
#include <terrace/terrain/metric_choice.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "names.hpp"

namespace terrace::python {
namespace {

/// Returns rows of a, b, height, size.
std::vector<std::array<double, 4>> rows_of_merges(const cluster::Dendrogram& result) {
  std::vector<std::array<double, 4>> rows;
  rows.reserve(result.merges.size());
  for (const cluster::Merge& merge : result.merges) {
    rows.push_back({static_cast<double>(merge.a), static_cast<double>(merge.b), merge.height,
                    static_cast<double>(merge.size)});
  }
  return rows;
}

/// Reads the number of threads, and the matrix's type and memory limit.
cluster::LinkageOptions linkage_options(const py::dict& choices) {
  cluster::LinkageOptions options;
  bool single_precision = false;
  take_option(choices, "single_precision", single_precision);
  if (single_precision) options.entry = cluster::MatrixEntry::float32;
  take_option(choices, "memory", options.memory_limit);
  take_option(choices, "threads", options.threads);
  options.threads = all_or(options.threads);
  return options;
}

/// Returns the linkage of points. edges: if given, single linkage considers only these pairs.
py::array linkage(const Array<double>& input, const std::string& method,
                  const std::optional<Array<std::uint32_t>>& edges, const py::dict& choices) {
  const std::vector<cluster::Point3> points = points3_of(input);
  const cluster::LinkageMethod kind = named<cluster::LinkageMethod>(method);
  cluster::LinkageOptions options = linkage_options(choices);
  bool gpu = false;
  take_option(choices, "gpu", gpu);
  std::span<const cluster::PointPair> pairs;
  if (edges) pairs = rows_of<2>(*edges, "edges");
  return to_array(released([&](const std::stop_token& stop) {
    options.check_stop = stop_check(stop);
    const std::span<const cluster::Point3> all(points);
    if (edges) return rows_of_merges(cluster::single_linkage(all, pairs, options.check_stop));
    if (gpu) {
      return rows_of_merges(kind == cluster::LinkageMethod::single
                                ? cluster::cuda_single_linkage(all)
                                : cluster::cuda_complete_linkage(all, options.entry));
    }
    return rows_of_merges(cluster::linkage(all, kind, options));
  }));
}

/// Returns the linkage along the edges of a tree in order of length.
py::array tree_linkage(const Array<std::uint32_t>& ends, const Array<double>& lengths) {
  const auto pairs = rows_of<2>(ends, "edges");
  const auto heights = numbers_of(lengths, "lengths");
  if (pairs.size() != heights.size()) {
    throw py::value_error("there are " + std::to_string(heights.size()) + " lengths for " +
                          std::to_string(pairs.size()) + " edges");
  }
  return to_array(released([&](const std::stop_token& stop) {
    std::vector<cluster::Link> links;
    links.reserve(pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      links.push_back({pairs[i][0], pairs[i][1], heights[i]});
    }
    return rows_of_merges(cluster::make_dendrogram(links.size() + 1, links, stop_check(stop)));
  }));
}

/// Returns the linkage of `count` things. distances: of all pairs i < j, ordered by i, then j.
py::array linkage_of_distances(std::size_t count, const Array<double>& input,
                               const std::string& method, const py::dict& choices) {
  const cluster::LinkageMethod kind = named<cluster::LinkageMethod>(method);
  const auto distances = numbers_of(input, "distances");
  if (count == 0 || count > cluster::kMostDendrogramPoints ||
      distances.size() != count * (count - 1) / 2) {
    throw py::value_error("the number of distances does not match the number of pairs");
  }
  const auto of_pair = [&](std::uint32_t i, std::uint32_t j) {
    return distances[i * (2 * count - i - 1) / 2 + (j - i - 1)];
  };
  cluster::LinkageOptions options = linkage_options(choices);
  return to_array(released([&](const std::stop_token& stop) {
    options.check_stop = stop_check(stop);
    return rows_of_merges(cluster::linkage(count, of_pair, kind, options));
  }));
}

/// Returns (ends of each edge, lengths).
py::tuple spanning_tree(const Array<double>& input, unsigned threads) {
  const std::vector<cluster::Point3> points = points3_of(input);
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<double> lengths;
  released([&](const std::stop_token& stop) {
    const cluster::LinkageOptions options{.threads = all_or(threads),
                                          .check_stop = stop_check(stop)};
    for (const cluster::Link& link : cluster::spanning_tree(points, options)) {
      edges.push_back({link.i, link.j});
      lengths.push_back(link.height);
    }
  });
  return py::make_tuple(to_array(std::move(edges)), to_array(std::move(lengths)));
}

py::array cut(const Array<double>& input, std::optional<std::size_t> count,
              std::optional<double> height) {
  const auto rows = rows_of<4>(input, "the linkage");
  return to_array(released([&] {
    cluster::Dendrogram dendrogram{.points = rows.size() + 1, .merges = {}};
    dendrogram.merges.reserve(rows.size());
    const double most = 2.0 * static_cast<double>(rows.size()) + 1;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (const std::size_t column : std::initializer_list<std::size_t>{0, 1, 3}) {
        if (rows[i][column] >= 0 && rows[i][column] <= most) continue;
        throw std::invalid_argument("row " + std::to_string(i) +
                                    " of the linkage has an invalid number");
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

/// Returns (centres, labels, sum of squared distances, iterations, converged).
py::tuple k_means(const Array<double>& array, const py::object& start, std::size_t clusters,
                  const Array<double>& weights, std::uint64_t seed, std::size_t restarts,
                  std::size_t max_iterations, double tolerance, unsigned threads) {
  const std::vector<cluster::Point3> points = points3_of(array);
  std::vector<cluster::Point3> centres;
  if (!start.is_none()) centres = points3_of(start.cast<Array<double>>());
  const auto weighing = numbers_of(weights, "weights");
  if (!weighing.empty() && weighing.size() != points.size()) {
    throw py::value_error("there are " + std::to_string(weighing.size()) + " weights for " +
                          std::to_string(points.size()) + " points");
  }
  cluster::KMeansOptions options{.clusters = clusters,
                                 .seed = seed,
                                 .restarts = restarts,
                                 .max_iterations = max_iterations,
                                 .tolerance = tolerance,
                                 .threads = all_or(threads)};
  cluster::KMeansResult result = released([&](const std::stop_token& stop) {
    options.check_stop = stop_check(stop);
    return centres.empty() ? cluster::k_means(points, weighing, options)
                           : cluster::k_means_from(centres, points, weighing, options);
  });
  return py::make_tuple(to_array(std::move(result.centres)), to_array(std::move(result.assignment)),
                        result.sse, result.iterations, result.converged);
}

/// Returns (facilities, labels with -1 for outliers, opening cost, connection cost, outlier cost,
/// lower bound).
py::tuple arrays_of_solution(cluster::FacilitySolution&& result) {
  return py::make_tuple(to_array(std::move(result.facilities)),
                        mark_missing(result.assignment, cluster::kOutlier), result.opening_cost,
                        result.connection_cost, result.outlier_cost, result.lower_bound);
}

/// Options for solving a facility location problem.
struct Search {
  /// Solves facility location, or k-median with `count` free facilities if that is set.
  template <class Problem>
  py::tuple solve(const Problem& problem) const {
    return arrays_of_solution(released([&](const std::stop_token& stop) {
      const auto keep_going = [&](auto...) { return !stop.stop_requested(); };
      if constexpr (!std::is_same_v<Problem, cluster::FacilityEntities>) {
        if (count) {
          cluster::KMedianOptions search = median;
          search.check_stop = stop_check(stop);
          return k_median(problem, *count, search);
        }
      } else if (count) {
        throw std::invalid_argument(
            "k-median does not support entities: pass their matrix of distances");
      }
      cluster::FacilityOptions search = options;
      search.progress = keep_going;
      search.check_stop = stop_check(stop);
      if (start) search.start = &*start;
      cluster::FacilitySolution result = cluster::solve(problem, search);
      // Searches for a better lower bound than the method's.
      if (bound_steps > 0) {
        const cluster::LowerBoundOptions bounding{.steps = bound_steps,
                                                  .threads = options.threads,
                                                  .progress = keep_going,
                                                  .check_stop = search.check_stop};
        const double bound = cluster::lower_bound(problem, result, bounding).lower_bound;
        result.lower_bound = std::max(result.lower_bound, bound);
      }
      return result;
    }));
  }

  cluster::FacilityOptions options;
  cluster::KMedianOptions median;
  std::optional<cluster::FacilitySolution> start;
  std::optional<std::size_t> count;
  std::size_t bound_steps = 0;
};

Search search_of(const py::dict& arguments) {
  Search search;
  const auto set = [&](const char* name, auto& to) { take_option(arguments, name, to); };
  take_named(arguments, "method", search.options.strategy);
  take_named(arguments, "effort", search.options.effort);
  set("seed", search.options.seed);
  set("threads", search.options.threads);
  search.options.threads = all_or(search.options.threads);
  set("steps", search.options.steps);
  set("restarts", search.options.restarts);
  set("batch", search.options.batch);
  set("assign_nearest", search.options.assign_nearest);
  set("seconds", search.options.seconds);
  set("count", search.count);
  set("bound_steps", search.bound_steps);
  if (search.options.restarts) search.median.restarts = *search.options.restarts;
  search.median.seed = search.options.seed;
  search.median.threads = search.options.threads;
  search.median.bound_steps = static_cast<std::uint32_t>(
      std::min(search.bound_steps, std::size_t{std::numeric_limits<std::uint32_t>::max()}));
  if (arguments.contains("start")) {
    const auto [facilities, labels] =
        arguments["start"].cast<std::pair<Array<std::uint32_t>, Array<std::int64_t>>>();
    const auto open = numbers_of(facilities, "facilities");
    cluster::FacilitySolution& start = search.start.emplace();
    start.facilities.assign(open.begin(), open.end());
    for (const std::int64_t label : numbers_of(labels, "labels")) {
      if (label < -1 || label >= static_cast<std::int64_t>(open.size())) {
        throw py::value_error("a label of `start` is not one of its clusters");
      }
      start.assignment.push_back(static_cast<std::uint32_t>(label));
    }
  }
  return search;
}

// The cast above turns -1 into kOutlier.
static_assert(cluster::kOutlier == static_cast<std::uint32_t>(std::int64_t{-1}));

py::tuple facility_location(const Array<double>& array, double facility_cost,
                            const std::string& metric, const Array<double>& weights,
                            const std::optional<Array<double>>& channels, double outlier_price,
                            const py::dict& choices) {
  Search search = search_of(choices);
  if (!search.options.restarts) search.median.restarts = 1;
  search.median.bound_steps = 0;
  const std::vector<cluster::Point3> points = points3_of(array);
  cluster::FacilityPoints problem{
      .points = points,
      .weights = numbers_of(weights, "weights"),
      .metric = terrain::MetricChoice::parse(metric).on_ground({}, cluster::kIdentityMap),
      .facility_cost = facility_cost,
      .outlier_price = outlier_price};
  std::vector<double> ones;
  if (channels) {
    if (channels->ndim() != 2 || static_cast<std::size_t>(channels->shape(0)) != points.size()) {
      throw py::value_error("`channels` must have one row per point");
    }
    ones.assign(static_cast<std::size_t>(channels->shape(1)), 1.0);
    problem.channels = {.values = {channels->data(), static_cast<std::size_t>(channels->size())},
                        .weights = ones};
  }
  return search.solve(problem);
}

/// Entities with the same number of corners each.
struct Entities {
  /// array: shape (n, corners, 2 or 3). ordered: whether three corners are a polyline.
  Entities(const Array<double>& array, bool ordered_) : ordered(ordered_) {
    if (array.ndim() != 3 || array.shape(1) < 1) {
      throw py::value_error("entities must have the shape (n, corners, 2 or 3)");
    }
    count = static_cast<std::size_t>(array.shape(0));
    corners = static_cast<std::size_t>(array.shape(1));
    places = points3_of(array.attr("reshape")(-1, array.shape(2)));
    for (std::size_t i = 0; i < places.size(); ++i) {
      for (const double coordinate : places[i]) {
        if (std::isfinite(coordinate)) continue;
        throw py::value_error("entity " + std::to_string(i / corners) +
                              " has a coordinate that is not finite; leave it out");
      }
    }
  }
  [[nodiscard]] std::span<const cluster::Point3> operator[](std::size_t i) const {
    return std::span(places).subspan(i * corners, corners);
  }
  [[nodiscard]] static double distance(std::span<const cluster::Point3> a,
                                       std::span<const cluster::Point3> b, bool ordered) {
    if (a.size() == 2) return cluster::segment_distance({a[0], a[1]}, {b[0], b[1]});
    if (a.size() == 3 && !ordered) {
      return cluster::triangle_distance({a[0], a[1], a[2]}, {b[0], b[1], b[2]});
    }
    return cluster::polyline_distance(a, b);
  }

  std::vector<cluster::Point3> places;
  std::size_t count = 0, corners = 0;
  bool ordered;
};

py::tuple entity_location(const Array<double>& array, bool ordered, double facility_cost,
                          const Array<double>& weights, double outlier_price,
                          const py::dict& choices) {
  const Search search = search_of(choices);
  const Entities entities(array, ordered);
  const double diagonal = cluster::diagonal(cluster::Euclidean{}, base::box_of(entities.places));
  return search.solve(cluster::FacilityEntities{.count = entities.count,
                                                .distance =
                                                    [&](std::uint32_t a, std::uint32_t b) {
                                                      return Entities::distance(
                                                          entities[a], entities[b], ordered);
                                                    },
                                                .symmetric = true,
                                                .triangle_inequality = true,
                                                .weights = numbers_of(weights, "weights"),
                                                .facility_cost = facility_cost * diagonal,
                                                .outlier_price = outlier_price * diagonal});
}

/// Returns the distances of each entity of `a` from each of `b`, row by row.
py::array entity_distances(const Array<double>& a, const Array<double>& b, bool ordered) {
  const Entities from(a, ordered), to(b, ordered);
  if (from.corners != to.corners)
    throw py::value_error("`a` and `b` have different numbers of corners");
  return to_array(released([&] {
    std::vector<double> distances;
    distances.reserve(from.count * to.count);
    for (std::size_t i = 0; i < from.count; ++i) {
      for (std::size_t j = 0; j < to.count; ++j) {
        distances.push_back(Entities::distance(from[i], to[j], ordered));
      }
    }
    return distances;
  }));
}

/// Solves facility location. connection: the cost of each facility (row) for each client (column).
/// opening: the cost of opening each facility.
py::tuple facility_matrix(const Array<double>& connection, const Array<double>& opening,
                          const py::dict& choices) {
  if (connection.ndim() != 2) throw py::value_error("connection costs must have two dimensions");
  const Search search = search_of(choices);
  return search.solve(cluster::FacilityMatrix{
      .facilities = static_cast<std::size_t>(connection.shape(0)),
      .clients = static_cast<std::size_t>(connection.shape(1)),
      .opening = numbers_of(opening, "opening costs"),
      .connection = {connection.data(), static_cast<std::size_t>(connection.size())}});
}

py::array clusters_of_size(const Array<double>& input, double size, std::uint64_t seed,
                           const py::tuple& settings) {
  const std::vector<cluster::Point3> points = points3_of(input);
  return to_array(Call(settings).run([&](const terrain::Context& context) {
    const auto report = [&](std::uint64_t done) {
      if (!context.progress) return;
      const double share = static_cast<double>(done) / static_cast<double>(points.size());
      context.progress({.what = "points", .count = done, .fraction = share});
    };
    auto labels = cluster::clusters_of_size(points, size, seed, context.threads, report,
                                            [&] { context.check_stop(); });
    if (context.progress) {
      context.progress({.what = "points", .count = points.size(), .fraction = 1, .ended = true});
    }
    return labels;
  }));
}

}  // namespace

void bind_cluster(py::module_& module) {
  module.def("linkage", &linkage);
  module.def("linkage_of_distances", &linkage_of_distances);
  module.def("tree_linkage", &tree_linkage);
  module.def("spanning_tree", &spanning_tree);
  module.def("cut", &cut);
  module.def("k_means", &k_means);
  module.def("facility_location", &facility_location);
  module.def("entity_location", &entity_location);
  module.def("entity_distances", &entity_distances);
  module.def("facility_matrix", &facility_matrix);
  module.def("clusters_of_size", &clusters_of_size);
}

}  // namespace terrace::python
