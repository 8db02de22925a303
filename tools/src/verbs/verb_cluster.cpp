// SPDX-License-Identifier: GPL-3.0-or-later
// cluster: clusters one file of points in memory, by any method of libcluster.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/cluster/block.hpp>
#include <terrace/cluster/dendrogram.hpp>
#include <terrace/cluster/facility_location.hpp>
#include <terrace/cluster/k_means.hpp>
#include <terrace/cluster/k_median.hpp>
#include <terrace/cluster/linkage.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "cli/output.hpp"
#include "tables/dendrogram_file.hpp"
#include "tables/label_file.hpp"
#include "tables/point_table.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/point_writer.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/metric_choice.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "terrace/terrain/point_file_crs.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;

using cluster::FacilityPoints;
using cluster::FacilitySolution;
using cluster::FacilityStrategy;
using cluster::Point3;

namespace {

enum class ClusterMethod : std::uint8_t {
  facility,
  primal_dual,
  k_means,
  k_median,
  linkage,
};

/// The request of `terrace cluster`, for points on the ground.
struct ClusterRequest {
  ClusterMethod method = ClusterMethod::facility;
  cluster::LinkageMethod linkage = cluster::LinkageMethod::single;
  std::string linkage_name;  ///< as the user wrote it
  cluster::FacilityStrategy strategy = cluster::FacilityStrategy::automatic;  ///< for facility
  std::string iterations;  ///< for facility: tenth, log10, log2 or a number; empty: by effort
  cluster::Effort effort = cluster::Effort::standard;
  std::size_t batch = 1;  ///< gains evaluated at once
  std::size_t k = 0;      ///< requested clusters; 0: not given
  std::optional<double> height;
  std::optional<std::uint32_t> bound_iterations;  ///< for the lower bound; 0: none
  std::size_t restarts = 1;
  bool single_precision = false;  ///< for the linkage matrix
  bool cuda = false;
  std::uint64_t seed = 1;
  unsigned threads = 1;
  std::uint64_t memory_bytes = 0;
};

struct ClusterOutcome {
  std::vector<std::uint32_t> representatives;  ///< per cluster: index of a point
  std::vector<std::uint32_t> labels;           ///< per point: its cluster, or cluster::kOutlier
  /// Set if the method minimises a cost. For k-means the connection cost is the sum of squares.
  std::optional<double> opening_cost, connection_cost, outlier_cost, lower_bound;
  std::optional<cluster::Dendrogram> dendrogram;
  std::vector<std::string> notes;  ///< notes for the user
};

/// Called from time to time with the share of the work done, if known; may throw to stop.
using ClusterProgress = std::function<void(double fraction)>;

/// Returns the costs, facilities and assignment of a solution.
ClusterOutcome outcome_of(FacilitySolution&& solution) {
  ClusterOutcome outcome;
  outcome.opening_cost = solution.opening_cost;
  outcome.connection_cost = solution.connection_cost;
  outcome.outlier_cost = solution.outlier_cost;
  if (solution.lower_bound > 0.0) outcome.lower_bound = solution.lower_bound;
  outcome.representatives = std::move(solution.facilities);
  outcome.labels = std::move(solution.assignment);
  return outcome;
}

void no_channels(const FacilityPoints& problem, const char* method) {
  if (problem.channels.size() > 0) {
    throw UsageError(std::string("--channel is for the methods facility, primal-dual and k-median, "
                                 "not for ") +
                     method);
  }
}

/// Returns the number of steps for the lower bound that take some seconds; 0 if the fewest that are
/// useful take much longer, because there are many points and few clusters. Each step examines as
/// many points around each point as a few clusters have.
std::uint32_t default_bound_steps(std::size_t points, std::size_t clusters) {
  constexpr double kFewest = 15.0, kMost = 300.0;
  constexpr double kDistances = 3e9, kMostDistances = 6e9;
  const double per_step = 4.0 * static_cast<double>(points) * static_cast<double>(points) /
                          static_cast<double>(clusters);
  if (kFewest * per_step > kMostDistances) return 0;
  return static_cast<std::uint32_t>(std::clamp(kDistances / per_step, kFewest, kMost));
}

/// Returns the outcome of `solution` with a lower bound, or with a note that none was computed.
ClusterOutcome bounded_outcome(const ClusterRequest& request, const FacilityPoints& problem,
                               FacilitySolution&& solution, const ClusterProgress& progress) {
  const std::uint32_t steps = request.bound_iterations.value_or(
      default_bound_steps(problem.points.size(), solution.facilities.size()));
  if (steps > 0) {
    cluster::LowerBoundOptions options;
    options.steps = steps;
    options.threads = request.threads;
    options.progress = [&](std::size_t done, std::size_t total) {
      progress(static_cast<double>(done) / static_cast<double>(total));
      return true;
    };
    options.check_stop = check_interrupt;
    solution.lower_bound = std::max(solution.lower_bound,
                                    cluster::lower_bound(problem, solution, options).lower_bound);
  }
  ClusterOutcome outcome = outcome_of(std::move(solution));
  if (steps == 0 && !request.bound_iterations && !outcome.lower_bound) {
    outcome.notes.emplace_back(
        "no lower bound of the cost: with few clusters of many points it takes long; "
        "--bound-iterations 15 computes one");
  }
  return outcome;
}

ClusterOutcome cluster_by_facilities(const ClusterRequest& request, const FacilityPoints& problem,
                                     const ClusterProgress& progress) {
  cluster::FacilityOptions options;
  options.strategy = request.strategy;
  // Here `fast` equals `default`: on one block it would only save milliseconds.
  options.effort = std::max(request.effort, cluster::Effort::standard);
  if (request.iterations == "tenth") {
    options.effort = cluster::Effort::standard;
  } else if (request.iterations == "log10") {
    options.effort = cluster::Effort::fine;
  } else if (request.iterations == "log2") {
    options.effort = cluster::Effort::full;
  } else if (!request.iterations.empty()) {
    options.steps = parse_count(request.iterations);
  }
  options.seed = request.seed;
  options.threads = request.threads;
  options.batch = request.batch;
  options.assign_nearest = true;
  options.progress = [&](std::size_t done, std::size_t total) {
    progress(static_cast<double>(done) / static_cast<double>(std::max<std::size_t>(total, 1)));
    return true;
  };
  options.check_stop = check_interrupt;
  // Use the production engine, unless an option asks for something that it does not support.
  constexpr std::size_t kFastPoints = std::size_t{1} << 24;
  if (request.strategy == FacilityStrategy::automatic && request.iterations.empty() &&
      request.batch == 1 && problem.channels.size() == 0 && std::isinf(problem.outlier_price) &&
      problem.points.size() < kFastPoints &&
      cluster::linear_map(problem.metric, base::box_of(problem.points))) {
    options.strategy = FacilityStrategy::fast;
  }
  FacilitySolution solution = cluster::solve(problem, options);
  progress(1.0);
  return bounded_outcome(request, problem, std::move(solution), progress);
}

/// Clusters by the primal-dual method.
ClusterOutcome cluster_by_growth(const ClusterRequest& request, const FacilityPoints& problem,
                                 const ClusterProgress& progress) {
  // Besides the matrix, the method keeps the clients sorted by facility: half as much again.
  FacilitySolution solution = cluster::solve(problem, {.strategy = FacilityStrategy::greedy_stars,
                                                       .memory_limit = request.memory_bytes / 3 * 2,
                                                       .check_stop = check_interrupt});
  return bounded_outcome(request, problem, std::move(solution), progress);
}

ClusterOutcome cluster_by_k_means(const ClusterRequest& request, const FacilityPoints& problem) {
  no_channels(problem, "k-means");
  const bool squared = std::holds_alternative<cluster::SquaredEuclidean>(problem.metric);
  const auto linear =
      cluster::linear_points(squared ? cluster::Euclidean{} : problem.metric, problem.points);
  if (!linear) {
    throw UsageError(
        "--method k-means sums squares: it takes --metric euclidean, squared, or elliptical with "
        "one region for all points");
  }
  const std::vector<Point3>& points = *linear;
  const cluster::KMeansResult result = cluster::k_means(points, problem.weights,
                                                        {.clusters = request.k,
                                                         .seed = request.seed,
                                                         .restarts = request.restarts,
                                                         .threads = request.threads,
                                                         .check_stop = check_interrupt});
  ClusterOutcome outcome;
  outcome.connection_cost = result.sse;
  outcome.labels = result.assignment;
  // Clusters that stayed empty for lack of distinct points do not count.
  std::vector<std::uint32_t> number(request.k, cluster::kOutlier);
  std::uint32_t used = 0;
  for (std::uint32_t& label : outcome.labels) {
    if (number[label] == cluster::kOutlier) number[label] = used++;
    label = number[label];
  }
  if (used < request.k) {
    outcome.notes.push_back(fmt::format("{}{}, and therefore no more clusters",
                                        used == 1 ? "there is only " : "there are only ",
                                        counted(used, "distinct point")));
  }
  if (!result.converged) {
    outcome.notes.push_back("k-means stopped after " + counted(result.iterations, "iteration") +
                            ", before it converged");
  }
  outcome.representatives = cluster::nearest_to_means(points, outcome.labels, used);
  return outcome;
}

ClusterOutcome cluster_by_k_median(const ClusterRequest& request, const FacilityPoints& problem) {
  // Each step computes the distances of all pairs. Fewer than a hundred steps give no useful bound.
  constexpr std::size_t kMostForBound = 10'000;
  const std::uint32_t steps =
      request.bound_iterations.value_or(problem.points.size() <= kMostForBound ? 100 : 0);
  ClusterOutcome outcome =
      outcome_of(cluster::k_median(problem, request.k,
                                   {.restarts = static_cast<std::uint32_t>(request.restarts),
                                    .bound_steps = steps,
                                    .seed = request.seed,
                                    .threads = request.threads,
                                    .check_stop = check_interrupt}));
  outcome.opening_cost.reset();
  return outcome;
}

/// Returns the whole tree, computed on the CPU.
cluster::Dendrogram tree_of(const ClusterRequest& request, const FacilityPoints& problem,
                            const std::optional<std::vector<Point3>>& points) {
  const std::string method = "--method " + request.linkage_name;
  cluster::LinkageOptions options;
  options.threads = request.threads;
  options.entry =
      request.single_precision ? cluster::MatrixEntry::float32 : cluster::MatrixEntry::float64;
  options.memory_limit = request.memory_bytes;
  options.check_stop = check_interrupt;
  if (points) return cluster::linkage(*points, request.linkage, options);
  switch (request.linkage) {
    case cluster::LinkageMethod::complete:
    case cluster::LinkageMethod::average:
    case cluster::LinkageMethod::weighted:
      break;
    case cluster::LinkageMethod::single:
      throw UsageError(method +
                       " uses the Euclidean minimum spanning tree: it takes --metric euclidean, or "
                       "elliptical with one region for all points");
    case cluster::LinkageMethod::ward:
    case cluster::LinkageMethod::centroid:
    case cluster::LinkageMethod::median:
      throw UsageError(method +
                       " measures distances of means: it takes --metric euclidean, or elliptical "
                       "with one region for all points");
  }
  if (!cluster::is_symmetric(problem.metric)) {
    throw UsageError(method +
                     " needs a symmetric metric: a field of ellipses is not symmetric (the points "
                     "are in several of its regions)");
  }
  return cluster::linkage(
      problem.points.size(),
      [&](std::uint32_t i, std::uint32_t j) {
        return cluster::distance(problem.metric, problem.points[i], problem.points[j]);
      },
      request.linkage, options);
}

ClusterOutcome cluster_by_linkage(const ClusterRequest& request, const FacilityPoints& problem) {
  no_channels(problem, request.linkage_name.c_str());
  if (!problem.weights.empty())
    throw UsageError("--weight does not apply to linkage, which counts no points");
  const std::optional<std::vector<Point3>> points =
      cluster::linear_points(problem.metric, problem.points);
  ClusterOutcome outcome;
  if (request.cuda) {
    if (!points) throw UsageError("--device cuda takes --metric euclidean or elliptical");
    outcome.dendrogram =
        request.linkage == cluster::LinkageMethod::single
            ? cluster::cuda_single_linkage(*points)
            : cluster::cuda_complete_linkage(*points, request.single_precision
                                                          ? cluster::MatrixEntry::float32
                                                          : cluster::MatrixEntry::float64);
  } else {
    outcome.dendrogram = tree_of(request, problem, points);
  }
  if (request.k != 0) outcome.labels = cluster::cut_count(*outcome.dendrogram, request.k);
  if (request.height) outcome.labels = cluster::cut_height(*outcome.dendrogram, *request.height);
  if (outcome.labels.empty()) return outcome;
  const std::size_t clusters =
      std::size_t{*std::max_element(outcome.labels.begin(), outcome.labels.end())} + 1;
  if (request.k != 0 && clusters < request.k) {
    outcome.notes.push_back(fmt::format("merges of equal height leave no cut into {}: there are {}",
                                        counted(request.k, "cluster"), clusters));
  }
  outcome.representatives = cluster::nearest_to_means(problem.points, outcome.labels, clusters);
  return outcome;
}

/// Clusters points. Throws UsageError for options that do not go together, std::invalid_argument
/// for invalid data, std::runtime_error (too little memory, no device), and what `progress` throws.
ClusterOutcome run_clustering(const ClusterRequest& request, const cluster::FacilityPoints& problem,
                              const ClusterProgress& progress) {
  // Checked here so that the message names the point for every method.
  cluster::check(problem);
  if (request.k > problem.points.size()) {
    throw UsageError(fmt::format("-k {} asks for more clusters than there are points ({})",
                                 request.k, problem.points.size()));
  }
  progress(0.0);
  switch (request.method) {
    case ClusterMethod::facility:
      return cluster_by_facilities(request, problem, progress);
    case ClusterMethod::primal_dual:
      return cluster_by_growth(request, problem, progress);
    case ClusterMethod::k_means:
      return cluster_by_k_means(request, problem);
    case ClusterMethod::k_median:
      return cluster_by_k_median(request, problem);
    case ClusterMethod::linkage:
      break;
  }
  return cluster_by_linkage(request, problem);
}

/// Columns that contribute to distances.
struct ChannelTable {
  std::vector<double> values;   ///< by point, then column
  std::vector<double> weights;  ///< metres per unit, by column
};

/// Reads the columns that the "NAME:WEIGHT" options name. Throws UsageError and what
/// PointTable::column() throws.
ChannelTable read_channels(const PointTable& table, const std::vector<std::string>& options) {
  ChannelTable channels;
  std::vector<std::vector<double>> columns;
  for (const std::string& text : options) {
    const auto& [name, weight] = parse_channel(text);
    columns.push_back(table.column(name));
    channels.weights.push_back(weight);
  }
  channels.values.resize(table.size() * columns.size());
  for (std::size_t c = 0; c < columns.size(); ++c) {
    for (std::size_t i = 0; i < table.size(); ++i) {
      channels.values[i * columns.size() + c] = columns[c][i];
    }
  }
  return channels;
}

/// Writes the table with two more columns, `cluster` and `representative` (the index of the point
/// that represents the cluster). Both are -1 for outliers. Existing columns of these names are
/// replaced. Throws stream::Error and stream::Stopped.
void write_clustered(const std::string& path, stream::WriterOptions writing,
                     const PointTable& table, const ClusterOutcome& outcome,
                     const CommonOptions& common) {
  // Replace the columns of an earlier clustering.
  struct Kept {
    std::size_t offset = 0, size = 0;
  };
  std::vector<stream::Channel> attributes;
  std::vector<Kept> kept;
  for (std::size_t c = 0; c < table.info.attributes.size(); ++c) {
    const stream::Channel& channel = table.info.attributes[c];
    if (channel.name == "cluster" || channel.name == "representative") continue;
    attributes.push_back(channel);
    kept.push_back({table.info.attribute_offset(c), stream::size_of(channel.type)});
  }
  attributes.push_back({.name = "cluster", .type = stream::ScalarType::i32});
  attributes.push_back({.name = "representative", .type = stream::ScalarType::i32});
  const std::uint64_t held = table.payload.size() + table.size() * sizeof(stream::Point3);
  writing.memory_bytes -= std::min(writing.memory_bytes, held);
  const auto writer = stream::open_point_writer(
      path,
      {.attributes = std::move(attributes),
       .comments = {kWriterMark},
       .crs = [&table] { return crs_of_point_file(table.info); },
       .height_unit = [&table] { return height_unit_of_point_file(table.info); },
       .lattice = lattice_of(table.info)},
      writing);
  writing_within_memory(*writer, path, common.memory_or(0), held);
  const std::string lost = lost_height_unit(path, *writer, table.info);
  if (!lost.empty()) common.say(lost);
  constexpr std::size_t kBlock = 65536;
  const std::size_t record_bytes = table.info.payload_size();
  stream::PointBlock block;
  for (std::size_t begin = 0; begin < table.size(); begin += kBlock) {
    check_interrupt();
    const std::size_t end = std::min(begin + kBlock, table.size());
    block.clear();
    for (std::size_t i = begin; i < end; ++i) {
      block.positions.push_back(table.positions[i]);
      const std::byte* const record = table.payload.data() + i * record_bytes;
      for (const Kept& part : kept) {
        block.payload.insert(block.payload.end(), record + part.offset,
                             record + part.offset + part.size);
      }
      const std::uint32_t cluster = outcome.labels[i];
      const bool outlier = cluster == cluster::kOutlier;
      const std::array<std::int32_t, 2> labels{
          outlier ? -1 : static_cast<std::int32_t>(cluster),
          outlier ? -1 : static_cast<std::int32_t>(outcome.representatives[cluster])};
      const auto bytes = std::as_bytes(std::span(labels));
      block.payload.insert(block.payload.end(), bytes.begin(), bytes.end());
    }
    writer->append(block);
  }
  writer->finish();
}

/// Returns the summary: clusters, costs, and the distance from the optimum.
Summary summary_of(const ClusterOutcome& outcome, std::uint64_t points, const Stopwatch& watch) {
  const auto rounded = [](double value) { return readable_number(value, 6); };
  const auto outliers = static_cast<std::size_t>(
      std::count(outcome.labels.begin(), outcome.labels.end(), cluster::kOutlier));
  std::optional<double> cost;
  if (outcome.connection_cost) {
    cost = *outcome.connection_cost + outcome.opening_cost.value_or(0.0) +
           outcome.outlier_cost.value_or(0.0);
  }
  std::optional<double> gap;
  if (cost && outcome.lower_bound && *outcome.lower_bound > 0) {
    gap = std::max(0.0, *cost / *outcome.lower_bound - 1.0);
  }
  Summary summary;
  summary.json = {{"points", points},
                  {"clusters", outcome.representatives.size()},
                  {"outliers", outliers},
                  {"cost", or_null(cost)},
                  {"opening_cost", or_null(outcome.opening_cost)},
                  {"connection_cost", or_null(outcome.connection_cost)},
                  {"outlier_cost", or_null(outcome.outlier_cost)},
                  {"lower_bound", or_null(outcome.lower_bound)},
                  {"gap", or_null(gap)}};
  summary.add_cost(watch);
  std::string& text = summary.text;
  text = counted(points, "point") + ", ";
  if (!outcome.labels.empty()) {
    text += counted(outcome.representatives.size(), "cluster");
    if (outliers > 0) text += " and " + counted(outliers, "outlier");
    text += ", ";
  }
  text += readable_seconds(watch.seconds()) + "\n";
  if (cost) {
    text += "cost " + rounded(*cost);
    if (outcome.opening_cost) {
      text += fmt::format(" = {} for opening + {} for connecting", rounded(*outcome.opening_cost),
                          rounded(*outcome.connection_cost));
    }
    if (outliers > 0) text += " + " + rounded(*outcome.outlier_cost) + " for outliers";
    text += "\n";
  }
  if (gap) {
    text += fmt::format("lower bound {}: at most {} % above the optimum\n",
                        rounded(*outcome.lower_bound), readable_bound(100 * *gap));
  }
  return summary;
}

class ClusterCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("input", input_, "file of points (or cells); - is standard input")
        ->required()
        ->type_name("FILE");
    app.add_option("-o,--output", output_,
                   "the points with columns 'cluster' and 'representative' (index of the point "
                   "that represents the cluster; -1: outlier); - is standard output")
        ->type_name("FILE");
    app.add_option("--labels", labels_, "one cluster number per line, in the order of the input")
        ->type_name("FILE");
    app.add_option("--dendrogram", dendrogram_,
                   "linkage: the whole tree as rows a,b,height,size (SciPy's)")
        ->type_name("FILE.csv");
    add_point_format(app, format_);
    add_input_format(app, input_format_);
    app.add_option("--method", method_,
                   "facility, primal-dual, k-means, k-median, or linkage: single, complete, "
                   "average, weighted, ward, centroid, median")
        ->capture_default_str()
        ->type_name("NAME");
    app.add_option("-k", request_.k, "number of clusters")
        ->check(CLI::Range(1U, 4294967295U))
        ->type_name("K");
    add_number(app, "--height", request_.height, "linkage: cut the tree at this distance",
               kNotNegative)
        ->type_name("H");
    add_number(app, "--facility-cost", facility_cost_,
               "times the diagonal of the points: larger makes fewer clusters", kFactor);
    add_number(app, "--outlier-price", outlier_price_,
               "facility: leave a point out if that is cheaper; times the diagonal", kFactor)
        ->type_name("PRICE");
    app.add_option("--strategy", strategy_,
                   "facility: automatic, fast, full-scan, quadtree, octree, kd-tree or facilities")
        ->capture_default_str()
        ->type_name("NAME");
    app.add_option("--iterations", request_.iterations,
                   "facility: tenth, log10, log2 (times N), or a number of candidates")
        ->type_name("N");
    app.add_option("--effort", effort_, "facility: how long to search")
        ->check(CLI::IsMember({"fast", "default", "fine", "full"}))
        ->capture_default_str();
    app.add_option("--batch", request_.batch, "facility: candidates evaluated at once")
        ->check(CLI::Range(1U, 4294967295U))
        ->capture_default_str();
    app.add_option("--restarts", request_.restarts,
                   "k-means, k-median: number of runs; the best is kept")
        ->check(CLI::Range(1U, 4294967295U))
        ->capture_default_str();
    app.add_option("--bound-iterations", request_.bound_iterations,
                   "steps for a lower bound of the cost; 0: none (default: a few seconds' worth; "
                   "none if 15 steps take much longer)")
        ->type_name("N");
    app.add_option(
           "--metric", metric_,
           "euclidean, squared, minkowski:P or elliptical:FILE (JSON: boxes with semi-axes)")
        ->capture_default_str()
        ->type_name("METRIC");
    app.add_option("--channel", channels_, "add a column to distances, one unit as WEIGHT metres")
        ->allow_extra_args(false)
        ->type_name("NAME:WEIGHT");
    app.add_option("--weight", weight_, "column with the points' weights")->type_name("NAME");
    add_number(app, "--z-weight", z_weight_, "weight of heights in distances", kFactorOrZero);
    app.add_flag("--single-precision", request_.single_precision,
                 "complete, average, weighted: a matrix of half the size");
    app.add_option("--device", device_, "single, complete: cpu or cuda")
        ->check(CLI::IsMember({"cpu", "cuda"}))
        ->capture_default_str();
  }

  Summary run(const CommonOptions& common) override {
    if (!output_.empty()) format_of_output(outputs::kPointFile, output_, format_);
    if (!labels_.empty()) format_of_output(outputs::kLabelFile, labels_);
    if (!dendrogram_.empty()) format_of_output(outputs::kDendrogramTable, dendrogram_);
    const Stopwatch watch;
    check_usage(common);
    const MetricChoice metric = MetricChoice::parse(metric_);
    stream::OutputGroup outputs;
    stream::WriterOptions writing;
    if (!output_.empty()) writing = point_writer_options(output_, format_, common);
    writing.replace.group = &outputs;
    stream::Naming replace_labels, replace_tree;
    if (!labels_.empty()) replace_labels = may_replace(labels_, common.force, outputs);
    if (!dendrogram_.empty()) replace_tree = may_replace(dendrogram_, common.force, outputs);

    request_.memory_bytes = common.memory_or(0);
    PointTable table = read_point_table(input_, input_format_, request_.memory_bytes, common);
    if (table.size() > std::numeric_limits<std::int32_t>::max()) {
      throw stream::Error(input_, "has " + counted(table.size(), "point"))
          .remedy("at most 2,147,483,647 are clustered in memory; build a store");
    }
    need_memory(table, common);
    const GroundFrame ground = GroundFrame::of(table, z_weight_);
    if (!ground.assumption.empty()) common.explain(input_ + ": " + ground.assumption);
    std::vector<cluster::Point3> positions(table.size());
    std::transform(table.positions.begin(), table.positions.end(), positions.begin(), ground);
    const std::vector<double> weights =
        weight_.empty() ? std::vector<double>() : table.column(weight_);
    const ChannelTable channels = read_channels(table, channels_);

    cluster::FacilityPoints problem;
    problem.points = positions;
    problem.weights = weights;
    const stream::Point3& scale = ground.scale;
    problem.metric =
        metric.on_ground(ground.origin, {scale[0], 0, 0, 0, scale[1], 0, 0, 0, scale[2]});
    problem.channels = {channels.values, channels.weights};
    problem.facility_cost = facility_cost_;
    if (outlier_price_) problem.outlier_price = *outlier_price_;

    ClusterOutcome outcome;
    {
      ProgressMeter meter(common.progress, "points");
      call_library(input_, method_, [&] {
        outcome = run_clustering(request_, problem, [&](double fraction) {
          check_interrupt();
          meter.update(static_cast<std::uint64_t>(fraction * static_cast<double>(table.size())),
                       fraction);
        });
      });
    }
    for (const std::string& note : outcome.notes) common.say(note);

    if (!labels_.empty()) write_labels(labels_, outcome.labels, replace_labels);
    if (!dendrogram_.empty()) write_dendrogram(dendrogram_, *outcome.dendrogram, replace_tree);
    if (!output_.empty()) {
      write_clustered(output_, writing, table, outcome, common);
    }
    outputs.commit();
    Summary summary = summary_of(outcome, table.size(), watch);
    // Costs are a result too, unless another result goes to standard output.
    summary.text_is_result = output_ != "-" && labels_ != "-" && dendrogram_ != "-";
    return summary;
  }

 private:
  /// Sets request_.memory_bytes to the memory left after the table. Throws stream::Error if the
  /// method needs more.
  void need_memory(const PointTable& table, const CommonOptions& common) {
    // Measured peak bytes per point. Methods that use a matrix check it themselves.
    const std::uint64_t each = request_.method == ClusterMethod::k_means   ? 120
                               : request_.method == ClusterMethod::linkage ? 240
                                                                           : 300;
    const std::uint64_t held =
        kProgramMemory + table.payload.size() + table.size() * sizeof(stream::Point3);
    const std::uint64_t needed = held + table.size() * each;
    const std::uint64_t memory = common.memory_or(0);
    if (needed > memory) {
      throw stream::Error(input_,
                          fmt::format("clustering its {} by {} needs {} MiB, --memory is {}",
                                      counted(table.size(), "point"), method_, (needed >> 20) + 1,
                                      readable_bytes(memory)))
          .remedy("raise --memory, or build a store, which takes points of any number");
    }
    request_.memory_bytes = memory - held;
  }

  void check_usage(const CommonOptions& common) {
    const auto method = choice<ClusterMethod>(method_, "--method",
                                              {{"facility", ClusterMethod::facility},
                                               {"primal-dual", ClusterMethod::primal_dual},
                                               {"k-means", ClusterMethod::k_means},
                                               {"k-median", ClusterMethod::k_median},
                                               {"single", ClusterMethod::linkage},
                                               {"complete", ClusterMethod::linkage},
                                               {"average", ClusterMethod::linkage},
                                               {"weighted", ClusterMethod::linkage},
                                               {"ward", ClusterMethod::linkage},
                                               {"centroid", ClusterMethod::linkage},
                                               {"median", ClusterMethod::linkage}});
    request_.method = method;
    request_.strategy = parse_strategy(strategy_);
    request_.effort = *effort_of(effort_);
    request_.cuda = device_ == "cuda";
    request_.seed = common.seed;
    request_.threads = common.threads;
    const bool tree = method == ClusterMethod::linkage;
    if (tree) {
      request_.linkage = *cluster::linkage_method_named(method_);
      request_.linkage_name = method_;
    }
    const bool flat = !output_.empty() || !labels_.empty();
    if (!flat && dendrogram_.empty()) {
      throw UsageError("no output given; pass -o FILE, --labels FILE or --dendrogram FILE");
    }
    if (!tree && (!dendrogram_.empty() || request_.height)) {
      throw UsageError(
          "--dendrogram and --height are for the methods of linkage: single, complete, average, "
          "weighted, ward, centroid and median");
    }
    if (request_.cuda && (!tree || (request_.linkage != cluster::LinkageMethod::single &&
                                    request_.linkage != cluster::LinkageMethod::complete))) {
      throw UsageError("--device cuda is for the methods single and complete");
    }
    if (tree && flat && request_.k == 0 && !request_.height) {
      throw UsageError("--method " + method_ + " gives a tree; cut it with -k K or --height H");
    }
    if (request_.k != 0 && request_.height) throw UsageError("give either -k or --height");
    const bool counts = method == ClusterMethod::k_means || method == ClusterMethod::k_median;
    if (counts && request_.k == 0) throw UsageError("--method " + method_ + " needs -k K");
    if (!counts && !tree && request_.k != 0) {
      throw UsageError("--method " + method_ +
                       " finds the number of clusters itself, by --facility-cost; -k is for "
                       "k-means, k-median and linkage");
    }
    if (method != ClusterMethod::facility &&
        (outlier_price_ || strategy_ != "automatic" || !request_.iterations.empty() ||
         request_.batch != 1)) {
      throw UsageError(
          "--outlier-price, --strategy, --iterations and --batch are for --method facility");
    }
    for (const auto& [a, b] : {std::pair(&output_, &labels_), std::pair(&output_, &dendrogram_),
                               std::pair(&labels_, &dendrogram_)}) {
      if (!a->empty() && *a == *b && *a != "-") throw UsageError("'" + *a + "' is named twice");
    }
    const int on_output = (output_ == "-") + (labels_ == "-") + (dendrogram_ == "-") + common.json;
    if (on_output > 1) throw UsageError("only one thing can go to standard output");
  }

  ClusterRequest request_;
  std::string input_, output_, labels_, dendrogram_, format_, input_format_;
  std::string method_ = "facility", effort_ = "default", metric_ = "euclidean", weight_;
  std::string device_ = "cpu", strategy_ = "automatic";
  std::vector<std::string> channels_;
  double facility_cost_ = 1.0, z_weight_ = 1.0;
  std::optional<double> outlier_price_;
};

}  // namespace

std::unique_ptr<Command> make_cluster() { return std::make_unique<ClusterCommand>(); }

}  // namespace terrace::tools
