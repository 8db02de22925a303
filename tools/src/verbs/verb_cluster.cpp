// SPDX-License-Identifier: GPL-3.0-or-later
// cluster: clusters one file of points in memory, by any method of libcluster.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

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
#include "verbs/cluster_methods.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;

namespace {

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

/// The bytes of one attribute within a record of a table.
struct AttributeBytes {
  std::size_t offset = 0, size = 0;
};

/// Writes the table with two more columns, `cluster` and `representative` (the index of the point
/// that represents the cluster). Both are -1 for outliers. They replace existing columns of the
/// same names, which are from an earlier clustering. Throws stream::Error and stream::Stopped.
void write_clustered_points(const std::string& path, stream::WriterOptions writing,
                            const PointTable& table, const ClusterOutcome& outcome,
                            const CommonOptions& common) {
  std::vector<stream::Channel> attributes;
  std::vector<AttributeBytes> copied;
  for (std::size_t c = 0; c < table.info.attributes.size(); ++c) {
    const stream::Channel& channel = table.info.attributes[c];
    if (channel.name == "cluster" || channel.name == "representative") continue;
    attributes.push_back(channel);
    copied.push_back({table.info.attribute_offset(c), stream::size_of(channel.type)});
  }
  attributes.push_back({.name = "cluster", .type = stream::ScalarType::i32});
  attributes.push_back({.name = "representative", .type = stream::ScalarType::i32});
  const std::uint64_t table_bytes = table.payload.size() + table.size() * sizeof(stream::Point3);
  writing.memory_bytes -= std::min(writing.memory_bytes, table_bytes);
  const auto writer =
      stream::open_point_writer(path,
                                {.attributes = std::move(attributes),
                                 .comments = {kWriterMark},
                                 .crs = [&table] { return crs_of_point_file(table.info); },
                                 .units = [&table] { return units_of_point_file(table.info); },
                                 .lattice = lattice_of(table.info)},
                                writing);
  writing_within_memory(*writer, path, common.memory_or(0), table_bytes);
  const std::string unit_note = lost_height_unit(path, *writer, table.info);
  if (!unit_note.empty()) common.say(unit_note);
  constexpr std::size_t kBlockPoints = 65536;
  const std::size_t record_bytes = table.info.payload_size();
  stream::PointBlock block;
  for (std::size_t begin = 0; begin < table.size(); begin += kBlockPoints) {
    check_interrupt();
    const std::size_t end = std::min(begin + kBlockPoints, table.size());
    block.clear();
    for (std::size_t i = begin; i < end; ++i) {
      block.positions.push_back(table.positions[i]);
      const std::byte* const record = table.payload.data() + i * record_bytes;
      for (const AttributeBytes& part : copied) {
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

/// Returns the summary: clusters, costs, and the relative gap to the lower bound of the cost.
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
    if (outliers > 0) text += fmt::format(" and {}", counted(outliers, "outlier"));
    text += ", ";
  }
  text += readable_seconds(watch.seconds()) + "\n";
  if (cost) {
    text += fmt::format("cost {}", rounded(*cost));
    if (outcome.opening_cost) {
      text += fmt::format(" = {} for opening + {} for connecting", rounded(*outcome.opening_cost),
                          rounded(*outcome.connection_cost));
    }
    if (outliers > 0) text += fmt::format(" + {} for outliers", rounded(*outcome.outlier_cost));
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
    define_files(app);
    define_method(app);
    define_search(app);
    define_distances(app);
  }

  Summary run(const CommonOptions& common) override {
    if (!output_.empty()) check_output_name(outputs::kPointFile, output_, format_);
    if (!labels_.empty()) check_output_name(outputs::kLabelFile, labels_);
    if (!dendrogram_.empty()) check_output_name(outputs::kDendrogramTable, dendrogram_);
    const Stopwatch watch;
    set_request(common);
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
    const PointTable table = read_point_table(input_, input_format_, request_.memory_bytes, common);
    if (table.size() > std::numeric_limits<std::int32_t>::max()) {
      throw stream::Error(input_, fmt::format("has {}", counted(table.size(), "point")))
          .remedy("at most 2,147,483,647 are clustered in memory; build a store");
    }
    check_memory(table, common);
    const ClusterOutcome outcome = cluster_table(table, metric, common);

    if (!labels_.empty()) write_labels(labels_, outcome.labels, replace_labels);
    if (!dendrogram_.empty()) write_dendrogram(dendrogram_, *outcome.dendrogram, replace_tree);
    if (!output_.empty()) write_clustered_points(output_, writing, table, outcome, common);
    outputs.commit();
    Summary summary = summary_of(outcome, table.size(), watch);
    // The costs are a result too, unless another result goes to standard output.
    summary.text_is_result = output_ != "-" && labels_ != "-" && dendrogram_ != "-";
    return summary;
  }

 private:
  void define_files(CLI::App& app) {
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
  }

  void define_method(CLI::App& app) {
    app.add_option("--method", method_,
                   "facility, primal-dual, k-means, k-median, or linkage: single, complete, "
                   "average, weighted, ward, centroid, median")
        ->capture_default_str()
        ->type_name("NAME");
    app.add_option("-k", request_.k, "number of clusters")
        ->check(CLI::Range(1U, 4294967295U))
        ->type_name("K");
    add_number(app, "--height", request_.height, "linkage: cut the tree at this distance",
               kNonNegative)
        ->type_name("H");
    add_number(app, "--facility-cost", facility_cost_,
               "times the diagonal of the points: larger makes fewer clusters", kFactor);
    add_number(app, "--outlier-price", outlier_price_,
               "facility: leave a point out if that is cheaper; times the diagonal", kFactor)
        ->type_name("PRICE");
  }

  /// Adds the options that trade time for quality.
  void define_search(CLI::App& app) {
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
  }

  /// Adds the options that change the distances between points, and how their matrix is computed.
  void define_distances(CLI::App& app) {
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

  /// Clusters the points of the table and prints notes. Throws what run_clustering() throws.
  ClusterOutcome cluster_table(const PointTable& table, const MetricChoice& metric,
                               const CommonOptions& common) {
    const GroundFrame ground = GroundFrame::of(table, z_weight_);
    if (!ground.assumption.empty()) common.say_verbose(input_ + ": " + ground.assumption);
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
    return outcome;
  }

  /// Sets request_.memory_bytes to the memory that the table leaves. Throws stream::Error if the
  /// method needs more.
  void check_memory(const PointTable& table, const CommonOptions& common) {
    // Measured peak. Methods with a distance matrix check its size themselves.
    const std::uint64_t bytes_per_point = request_.method == ClusterMethod::k_means   ? 120
                                          : request_.method == ClusterMethod::linkage ? 240
                                                                                      : 300;
    const std::uint64_t used =
        kProgramMemory + table.payload.size() + table.size() * sizeof(stream::Point3);
    const std::uint64_t needed = used + table.size() * bytes_per_point;
    const std::uint64_t memory = common.memory_or(0);
    if (needed > memory) {
      throw stream::Error(input_,
                          fmt::format("clustering its {} by {} needs {} MiB, --memory is {}",
                                      counted(table.size(), "point"), method_, (needed >> 20) + 1,
                                      readable_bytes(memory)))
          .remedy("raise --memory, or build a store, which takes points of any number");
    }
    request_.memory_bytes = memory - used;
  }

  /// Sets request_ from the options. Throws UsageError if an option names nothing known.
  void set_request(const CommonOptions& common) {
    request_.method = choice<ClusterMethod>(method_, "--method",
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
    request_.strategy = parse_strategy(strategy_);
    request_.effort = *effort_of(effort_);
    request_.cuda = device_ == "cuda";
    request_.seed = common.seed;
    request_.threads = common.threads;
    if (request_.method == ClusterMethod::linkage) {
      request_.linkage = *cluster::linkage_method_named(method_);
      request_.linkage_name = method_;
    }
  }

  /// Throws UsageError if the options contradict each other.
  void check_usage(const CommonOptions& common) const {
    const ClusterMethod method = request_.method;
    const bool linkage = method == ClusterMethod::linkage;
    const bool needs_clusters = !output_.empty() || !labels_.empty();
    if (!needs_clusters && dendrogram_.empty()) {
      throw UsageError("no output given; pass -o FILE, --labels FILE or --dendrogram FILE");
    }
    if (!linkage && (!dendrogram_.empty() || request_.height)) {
      throw UsageError(
          "--dendrogram and --height are for the methods of linkage: single, complete, average, "
          "weighted, ward, centroid and median");
    }
    if (request_.cuda && (!linkage || (request_.linkage != cluster::LinkageMethod::single &&
                                       request_.linkage != cluster::LinkageMethod::complete))) {
      throw UsageError("--device cuda is for the methods single and complete");
    }
    if (linkage && needs_clusters && request_.k == 0 && !request_.height) {
      throw UsageError(
          fmt::format("--method {} gives a tree; cut it with -k K or --height H", method_));
    }
    if (request_.k != 0 && request_.height) throw UsageError("give either -k or --height");
    const bool needs_k = method == ClusterMethod::k_means || method == ClusterMethod::k_median;
    if (needs_k && request_.k == 0)
      throw UsageError(fmt::format("--method {} needs -k K", method_));
    if (!needs_k && !linkage && request_.k != 0) {
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
    check_outputs(common);
  }

  /// Throws UsageError if two outputs have the same name or use standard output.
  void check_outputs(const CommonOptions& common) const {
    for (const auto& [a, b] : {std::pair(&output_, &labels_), std::pair(&output_, &dendrogram_),
                               std::pair(&labels_, &dendrogram_)}) {
      if (!a->empty() && *a == *b && *a != "-") throw UsageError("'" + *a + "' is named twice");
    }
    const int on_stdout = (output_ == "-") + (labels_ == "-") + (dendrogram_ == "-") + common.json;
    if (on_stdout > 1) throw UsageError("only one thing can go to standard output");
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
