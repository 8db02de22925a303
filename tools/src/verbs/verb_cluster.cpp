// SPDX-License-Identifier: GPL-3.0-or-later
// cluster: clusters one file of points in memory, by any method of libcluster.
#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "cli/output.hpp"
#include "tables/cluster_run.hpp"
#include "tables/dendrogram_file.hpp"
#include "tables/label_file.hpp"
#include "tables/point_table.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/point_writer.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/metric_choice.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {
namespace {

/// Columns that count in distances.
struct ChannelTable {
  std::vector<double> values;   ///< by point, then column
  std::vector<double> weights;  ///< metres of a unit, by column
};

/// options: "NAME:WEIGHT" of columns. Throws: UsageError; what PointTable::column() throws.
ChannelTable read_channels(const PointTable& table, const std::vector<std::string>& options) {
  ChannelTable channels;
  std::vector<std::vector<double>> columns;
  for (const std::string& text : options) {
    const auto& [name, weight] = channel_of(text);
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

/// The table with two more columns, `cluster` and `representative` (the number of the point that
/// stands for the cluster), both -1 for outliers; columns of these names are replaced.
/// Throws: stream::Error, Interrupted.
void write_clustered(const std::string& path, stream::WriterOptions writing,
                     const PointTable& table, const ClusterOutcome& outcome,
                     std::uint64_t memory_bytes) {
  // Columns of an earlier clustering are replaced.
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
  const auto writer = stream::open_point_writer(path,
                                                {.attributes = std::move(attributes),
                                                 .comments = {kWriterMark},
                                                 .crs = crs_to_write(table.info.crs),
                                                 .lattice = lattice_of(table.info)},
                                                writing);
  writing_within_memory(*writer, path, memory_bytes, held);
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

/// Clusters, costs, and how far from the optimum.
Summary summary_of(const ClusterOutcome& outcome, std::uint64_t points, const Stopwatch& watch) {
  const auto rounded = [](double value) { return readable_number(value, 6); };
  const auto outliers = static_cast<std::size_t>(
      std::count(outcome.labels.begin(), outcome.labels.end(), cluster::kOutlier));
  const auto number = [](const std::optional<double>& value) -> nlohmann::ordered_json {
    return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
  };
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
                  {"cost", number(cost)},
                  {"opening_cost", number(outcome.opening_cost)},
                  {"connection_cost", number(outcome.connection_cost)},
                  {"outlier_cost", number(outcome.outlier_cost)},
                  {"lower_bound", number(outcome.lower_bound)},
                  {"gap", number(gap)}};
  summary.add_cost(watch);
  std::string& text = summary.text;
  text = with_commas(points) + " points, ";
  if (!outcome.labels.empty()) {
    text += with_commas(outcome.representatives.size()) + " clusters";
    if (outliers > 0) text += " and " + with_commas(outliers) + " outliers";
    text += ", ";
  }
  text += readable_seconds(watch.seconds()) + "\n";
  if (cost) {
    text += "cost " + rounded(*cost);
    if (outcome.opening_cost) {
      text += " = " + rounded(*outcome.opening_cost) + " for opening + " +
              rounded(*outcome.connection_cost) + " for connecting";
    }
    if (outliers > 0) text += " + " + rounded(*outcome.outlier_cost) + " for outliers";
    text += "\n";
  }
  if (gap) {
    text += "lower bound " + rounded(*outcome.lower_bound) + ": at most " +
            readable_bound(100 * *gap) + " % above the optimum\n";
  }
  return summary;
}

class ClusterCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("input", input_, "File of points (or cells); - is standard input")
        ->required()
        ->type_name("FILE");
    app.add_option(
           "-o,--output", output_,
           "The points with columns 'cluster' and 'representative' (the number of the point "
           "that stands for the cluster; -1: outlier); - is standard output")
        ->type_name("FILE");
    app.add_option("--labels", labels_, "One cluster number per line, in the order of the input")
        ->type_name("FILE");
    app.add_option("--dendrogram", dendrogram_,
                   "single, complete: the whole tree as rows a,b,height,size (SciPy's)")
        ->type_name("FILE.csv");
    app.add_option(
           "--format", format_,
           "Format of the output: xyz, csv, ply, ply-ascii, las, laz, copc; else by its ending")
        ->type_name("NAME");
    app.add_option("--input-format", input_format_,
                   "Format of the input; else by its content, then its ending")
        ->type_name("NAME");
    app.add_option("--method", method_,
                   "facility, primal-dual, k-means, k-median, single or complete")
        ->capture_default_str()
        ->type_name("NAME");
    app.add_option("-k", request_.k, "Number of clusters")
        ->check(CLI::Range(1U, 4294967295U))
        ->type_name("K");
    add_number(app, "--height", request_.height, "single, complete: cut the tree at this distance",
               kNotNegative)
        ->type_name("H");
    add_number(app, "--facility-cost", facility_cost_,
               "Times the diagonal of the points: larger makes fewer clusters", kFactor);
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
                   "k-means, k-median: number of runs; the best one counts")
        ->check(CLI::Range(1U, 4294967295U))
        ->capture_default_str();
    app.add_option("--bound-iterations", request_.bound_iterations,
                   "Steps towards a lower bound of the cost; 0: none (default: some seconds)")
        ->type_name("N");
    app.add_option(
           "--metric", metric_,
           "euclidean, squared, minkowski:P or elliptical:FILE (JSON: boxes with semi-axes)")
        ->capture_default_str()
        ->type_name("METRIC");
    app.add_option("--channel", channels_,
                   "A column that counts in distances, one unit as WEIGHT metres")
        ->allow_extra_args(false)
        ->type_name("NAME:WEIGHT");
    app.add_option("--weight", weight_, "The column of the points' weights")->type_name("NAME");
    add_number(app, "--z-weight", z_weight_, "How much heights count in a distance", kFactorOrZero);
    app.add_flag("--single-precision", request_.single_precision,
                 "complete: a matrix of half the size");
    app.add_option("--device", device_, "single, complete: cpu or cuda")
        ->check(CLI::IsMember({"cpu", "cuda"}))
        ->capture_default_str();
  }

  Summary run(const CommonOptions& common) override {
    const Stopwatch watch;
    check_usage(common);
    const MetricChoice metric = MetricChoice::parse(metric_);
    stream::WriterOptions writing;
    if (!output_.empty()) writing = point_writer_options(output_, format_, common);
    const bool replace_labels = labels_.empty() ? false : may_replace(labels_, common.force);
    const bool replace_tree = dendrogram_.empty() ? false : may_replace(dendrogram_, common.force);

    request_.memory_bytes = common.memory_or(0);
    PointTable table = read_point_table(input_, input_format_, request_.memory_bytes, common);
    if (table.size() > std::numeric_limits<std::int32_t>::max()) {
      throw stream::Error(
          {.file = input_,
           .where = {},
           .cause = "has " + with_commas(table.size()) + " points",
           .remedy = "at most 2,147,483,647 are clustered in memory; build a store"});
    }
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
      write_clustered(output_, writing, table, outcome, request_.memory_bytes);
    }
    Summary summary = summary_of(outcome, table.size(), watch);
    // Costs are a result too, unless another one goes to standard output.
    summary.text_is_result = output_ != "-" && labels_ != "-" && dendrogram_ != "-";
    return summary;
  }

 private:
  void check_usage(const CommonOptions& common) {
    const auto method = choice<ClusterMethod>(method_, "--method",
                                              {{"facility", ClusterMethod::facility},
                                               {"primal-dual", ClusterMethod::primal_dual},
                                               {"k-means", ClusterMethod::k_means},
                                               {"k-median", ClusterMethod::k_median},
                                               {"single", ClusterMethod::single},
                                               {"complete", ClusterMethod::complete}});
    request_.method = method;
    request_.strategy = parse_strategy(strategy_);
    request_.effort = *effort_of(effort_);
    request_.cuda = device_ == "cuda";
    request_.seed = common.seed;
    request_.threads = common.threads;
    const bool tree = method == ClusterMethod::single || method == ClusterMethod::complete;
    const bool flat = !output_.empty() || !labels_.empty();
    if (!flat && dendrogram_.empty()) {
      throw UsageError(
          "there is nothing to write: name -o FILE, --labels FILE or --dendrogram FILE");
    }
    if (!tree && (!dendrogram_.empty() || request_.height || request_.cuda)) {
      throw UsageError(
          "--dendrogram, --height and --device are for the methods single and complete");
    }
    if (tree && flat && request_.k == 0 && !request_.height) {
      throw UsageError("--method " + method_ +
                       " gives a tree: say where to cut it, with -k K or "
                       "--height H");
    }
    if (request_.k != 0 && request_.height) throw UsageError("give either -k or --height");
    const bool counts = method == ClusterMethod::k_means || method == ClusterMethod::k_median;
    if (counts && request_.k == 0) throw UsageError("--method " + method_ + " needs -k K");
    if (!counts && !tree && request_.k != 0) {
      throw UsageError("--method " + method_ +
                       " finds the number of clusters itself, by --facility-cost; -k is for "
                       "k-means, k-median, single and complete");
    }
    if (method != ClusterMethod::facility &&
        (outlier_price_ || strategy_ != "automatic" || !request_.iterations.empty() ||
         request_.batch != 1)) {
      throw UsageError(
          "--outlier-price, --strategy, --iterations and --batch are for --method "
          "facility");
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
