// SPDX-License-Identifier: GPL-3.0-or-later
// match: pairs the points of one file at the least total distance, or builds the tree of repeated
// matching, which for triangles includes their boxes.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/base/portable_math.hpp>
#include <terrace/cluster/hierarchy.hpp>
#include <terrace/matching/bounding_volume_hierarchy.hpp>
#include <terrace/matching/halving.hpp>
#include <terrace/matching/large_matching.hpp>
#include <terrace/matching/matching_tree.hpp>
#include <terrace/matching/point.hpp>
#include <terrace/matching/point_matching.hpp>

#include "base/stored_entities.hpp"
#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "cli/output.hpp"
#include "tables/label_file.hpp"
#include "tables/point_table.hpp"
#include "terrace/stream/sink.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;

using matching::Point3;

namespace {

enum class MatchMethod : std::uint8_t { automatic, exact, monotone, monte_carlo };

/// Called from time to time with the work done and the total, in any unit; may throw to stop.
using MatchProgress = std::function<bool(std::uint64_t done, std::uint64_t total, double)>;

/// The request of `terrace match`, for points on the ground.
struct MatchRequest {
  MatchMethod method = MatchMethod::automatic;
  std::span<const std::uint32_t> labels{};  ///< cluster of each point; empty if not given
  std::uint64_t iterations = 0;             ///< iterations of halving; 0: as many as points
  double seconds = 0.0;                     ///< time limit of halving; 0: no limit
  std::uint64_t seed = 1;
  unsigned threads = 1;
  std::uint64_t memory_bytes = 0;  ///< limit for the whole process; 0: no limit
  std::uint64_t used_bytes = 0;    ///< used by the program and the points already
};

struct MatchOutcome {
  /// Partner of each point; matching::kNone for the unmatched one of an odd number.
  std::vector<std::uint32_t> mate;
  double cost = 0.0;
  std::uint64_t iterations = 0;       ///< iterations of halving, or rounds of windows
  std::optional<double> lower_bound;  ///< if the method provides one
  bool optimal = false;
  std::size_t clusters = 0;  ///< clusters matched first; 0: none
};

struct TreeOutcome {
  matching::MatchingTree<matching::Point3> tree;
  std::size_t clusters = 0;  ///< clusters with separate trees; 0: none
};

/// Size in points of the clusters that are matched first in large sets.
constexpr double kClusterSize = 10000;
/// Memory of an exact matching in bytes per point, measured.
constexpr std::uint64_t kExactBytes = 800;
/// Memory of a matching by windows in bytes per point, without the windows being solved.
constexpr std::uint64_t kWindowBytes = 110;

/// Throws std::runtime_error, which suggests `remedy`, if `needed` bytes in addition to the used
/// ones exceed the memory limit.
void check_memory(std::uint64_t needed, const MatchRequest& request, std::size_t points,
                  const char* remedy) {
  needed += request.used_bytes;
  if (request.memory_bytes == 0 || needed <= request.memory_bytes) return;
  throw std::runtime_error(fmt::format("matching {} takes about {} and --memory is {}: {}",
                                       counted(points, "point"), readable_bytes(needed),
                                       readable_bytes(request.memory_bytes), remedy));
}

std::size_t count_distinct(std::span<const std::uint32_t> labels) {
  std::vector<std::uint32_t> sorted(labels.begin(), labels.end());
  std::sort(sorted.begin(), sorted.end());
  return static_cast<std::size_t>(std::unique(sorted.begin(), sorted.end()) - sorted.begin());
}

/// Returns the memory that a method may use, in bytes. If there is a limit it is at least 1,
/// because 0 means no limit.
std::uint64_t available_memory(const MatchRequest& request) {
  if (request.memory_bytes == 0) return 0;
  return std::max<std::uint64_t>(
      request.memory_bytes - std::min(request.memory_bytes, request.used_bytes), 1);
}

matching::HalvingOptions halving_options(const MatchRequest& request) {
  matching::HalvingOptions options;
  options.method = request.method == MatchMethod::monotone ? matching::Halving::monotone
                                                           : matching::Halving::monte_carlo;
  options.iterations = request.iterations;
  if (request.seconds > 0) options.seconds = request.seconds;
  options.seed = request.seed;
  options.threads = request.threads;
  options.memory_limit = available_memory(request);
  options.check_stop = check_interrupt;
  return options;
}

bool uses_halving(MatchMethod method) {
  return method == MatchMethod::monotone || method == MatchMethod::monte_carlo;
}

/// Returns whether clusters are matched first. They come from the caller, or from facility location
/// if there are too many points to match at once.
bool has_clusters(const MatchRequest& request, std::size_t points) {
  if (!request.labels.empty()) return true;
  return request.method == MatchMethod::automatic &&
         points > matching::LargeMatchingOptions{}.exact_limit;
}

/// Returns the clusters to match first; empty if there are none.
std::vector<std::uint32_t> clusters_of(const MatchRequest& request, std::span<const Point3> points,
                                       const MatchProgress& progress) {
  if (!request.labels.empty()) return {request.labels.begin(), request.labels.end()};
  if (!has_clusters(request, points.size())) return {};
  return cluster::clusters_of_size(
      points, kClusterSize, request.seed, request.threads,
      [&](std::uint64_t done) { progress(done, points.size(), 0); }, check_interrupt);
}

/// Pairs points. Sets too large for an exact matching are first clustered by facility location
/// (`automatic`), unless there are labels. Throws std::invalid_argument for invalid data,
/// std::runtime_error if the memory does not suffice, and what `progress` throws.
MatchOutcome run_matching(const MatchRequest& request, std::span<const Point3> points,
                          const MatchProgress& progress) {
  MatchOutcome outcome;
  if (uses_halving(request.method)) {
    matching::HalvingOptions options = halving_options(request);
    options.progress = progress;
    matching::HalvingMatching matching = matching::match_by_halving(points, options);
    outcome.mate = std::move(matching.mate);
    outcome.cost = matching.cost;
    outcome.iterations = matching.iterations;
    return outcome;
  }
  matching::LargeMatchingOptions options;
  if (request.method == MatchMethod::exact) options.exact_limit = points.size();
  const bool exact = !has_clusters(request, points.size());
  if (exact) {
    check_memory(kExactBytes * points.size(), request, points.size(),
                 "raise it, or name clusters with --labels");
  } else {
    check_memory(kWindowBytes * points.size() + kExactBytes * options.window * request.threads,
                 request, points.size(), "raise it, or take fewer --threads");
  }
  const std::vector<std::uint32_t> labels = clusters_of(request, points, progress);
  options.labels = labels;
  options.threads = request.threads;
  options.progress = progress;
  options.check_stop = check_interrupt;
  matching::LargeMatching matching = matching::match_large(points, options);
  outcome.mate = std::move(matching.mate);
  outcome.cost = matching.cost;
  outcome.iterations = matching.rounds;
  outcome.lower_bound = matching.dual_bound;
  outcome.optimal = matching.optimal;
  outcome.clusters = exact ? 0 : count_distinct(labels);
  return outcome;
}

/// Returns the tree of repeated matching, with each level matched by the requested method. Throws
/// as run_matching() does.
TreeOutcome run_matching_tree(const MatchRequest& request, std::span<const Point3> points,
                              const MatchProgress& progress) {
  // The tree and the level being matched.
  const std::uint64_t tree_bytes = 120 * points.size();
  check_memory(
      has_clusters(request, points.size()) ? tree_bytes : tree_bytes + kExactBytes * points.size(),
      request, points.size(), "raise it, or name clusters with --labels");
  const std::vector<std::uint32_t> labels = clusters_of(request, points, progress);
  matching::MatchingTreeOptions<Point3> options;
  options.labels = labels;
  options.threads = request.threads;
  options.memory_limit = available_memory(request);
  if (uses_halving(request.method)) {
    options.matcher = [&](std::span<const Point3> nodes) {
      matching::HalvingOptions halving = halving_options(request);
      // The clusters are matched in parallel already.
      if (!labels.empty()) halving.threads = 1;
      return std::move(matching::match_by_halving(nodes, halving).mate);
    };
  } else if (request.method == MatchMethod::exact) {
    options.matcher = [](std::span<const Point3> nodes) {
      matching::PointMatchingOptions matching;
      matching.check_stop = check_interrupt;
      return std::move(matching::match_points(nodes, matching).mate);
    };
  }
  options.progress = [&](std::size_t done, std::size_t total) { return progress(done, total, 0); };
  options.check_stop = check_interrupt;
  return {matching::make_matching_tree(points, options),
          labels.empty() ? 0 : count_distinct(labels)};
}

class MatchCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("input", input_, "file of points (or cells); - is standard input")
        ->required()
        ->type_name("FILE");
    add_output(app, output_,
               "the pairs, rows a,b,distance: indices of points in the input, from 0, and metres; "
               "with --tree rows a,b,distance,size,level, for triangles also the box of all below: "
               "minx,miny,minz,maxx,maxy,maxz; - is standard output");
    add_input_format(app, input_format_);
    app.add_option("--method", method_,
                   "auto: the optimum up to half a million points, beyond that clusters first, "
                   "then windows, with a proven bound; exact: the optimum; monotone: repeated "
                   "halving, near the optimum; monte-carlo: random halving, as in the thesis")
        ->capture_default_str()
        ->type_name("NAME");
    app.add_option(
           "--iterations", iterations_,
           "monotone, monte-carlo: maximum number of iterations (default: the number of points)")
        ->type_name("N");
    add_number(app, "--seconds", seconds_,
               "monotone, monte-carlo: start no iteration after S seconds", kPositive)
        ->type_name("S");
    add_number(app, "--z-weight", z_weight_, "weight of heights in distances", kFactorOrZero);
    app.add_flag("--tree", tree_,
                 "match the pairs again, up to one root: a binary tree. With n points, row k is "
                 "node n + k and joins the nodes a and b; size counts the points below");
    app.add_option(
           "--entities", entities_,
           "triangles: match the triangles of a mesh (GLB, OBJ, OFF, PLY, STL) by their centroids "
           "instead of its vertices; needs --tree, which becomes a bounding volume hierarchy")
        ->check(CLI::IsMember({"points", "triangles"}))
        ->capture_default_str();
    app.add_option("--labels", labels_,
                   "one cluster number per line, in the order of the input: match within clusters "
                   "first")
        ->type_name("FILE");
  }

  Summary run(const CommonOptions& common) override {
    check_output_name(outputs::kPairsTable, output_);
    const Stopwatch watch;
    MatchRequest request = request_of(common);
    const stream::Naming replace = may_replace(output_, common.force);
    const bool triangles = entities_ == "triangles";
    if (triangles && !tree_) throw UsageError("--entities triangles is for --tree");
    PointTable table = read_point_table(input_, input_format_, common.memory_or(0), common,
                                        *stream::entities_named(entities_));
    std::vector<base::Box3> boxes;
    if (triangles) boxes = to_centroids(table);
    const GroundFrame ground = GroundFrame::of(table, z_weight_);
    if (!ground.assumption.empty()) common.say_verbose(input_ + ": " + ground.assumption);
    std::vector<std::uint32_t> labels;
    if (!labels_.empty()) labels = read_labels(labels_, table.size());
    request.labels = labels;
    request.used_bytes = kProgramMemory + table.payload.size() +
                         table.size() * 2 * sizeof(stream::Point3) +
                         boxes.size() * sizeof(base::Box3);
    positions_.resize(table.size());
    std::transform(table.positions.begin(), table.positions.end(), positions_.begin(), ground);

    ProgressMeter meter(common.progress, tree_ ? "pairs" : "steps");
    const MatchProgress progress = [&](std::uint64_t done, std::uint64_t total, double) {
      check_interrupt();
      meter.update(done, static_cast<double>(done) / static_cast<double>(total));
      return true;
    };
    if (tree_) {
      TreeOutcome outcome;
      call_library(input_, method_,
                   [&] { outcome = run_matching_tree(request, positions_, progress); });
      return write_tree(outcome, std::move(boxes), replace, watch);
    }
    MatchOutcome outcome;
    call_library(input_, method_, [&] { outcome = run_matching(request, positions_, progress); });
    std::size_t pairs = 0;
    write(rows_of(outcome, pairs), replace);
    return summary_of(outcome, pairs, watch);
  }

 private:
  /// Writes the tree and returns its summary. `boxes` are those of the triangles, if it has any:
  /// the tree is then also a bounding volume hierarchy.
  [[nodiscard]] Summary write_tree(const TreeOutcome& outcome, std::vector<base::Box3> boxes,
                                   const stream::Naming& replace, const Stopwatch& watch) const {
    if (boxes.empty()) {
      write(rows_of(outcome), replace);
      return summary_of(outcome, watch);
    }
    const matching::BoundingVolumeHierarchy<3> hierarchy(matching::tree_children(outcome.tree.rows),
                                                         boxes);
    write(rows_of(outcome, std::move(boxes)), replace);
    Summary summary = summary_of(outcome, watch);
    summary.json["depth"] = hierarchy.depth();
    summary.json["surface_area_cost"] = hierarchy.surface_area_cost();
    summary.text += fmt::format("as a bounding volume hierarchy: depth {}, surface area cost {}\n",
                                with_commas(hierarchy.depth()),
                                readable_number(hierarchy.surface_area_cost(), 4));
    return summary;
  }

  [[nodiscard]] MatchRequest request_of(const CommonOptions& common) const {
    MatchRequest request;
    request.method = choice<MatchMethod>(method_, "--method",
                                         {{"auto", MatchMethod::automatic},
                                          {"exact", MatchMethod::exact},
                                          {"monotone", MatchMethod::monotone},
                                          {"monte-carlo", MatchMethod::monte_carlo}});
    if (!uses_halving(request.method) && (!iterations_.empty() || seconds_)) {
      throw UsageError("--iterations and --seconds are for --method monotone and monte-carlo");
    }
    if (!labels_.empty() && !tree_ && request.method != MatchMethod::automatic) {
      throw UsageError("--labels is for --method auto, or for --tree with any method");
    }
    request.iterations = iterations_.empty() ? 0 : count_of_option("--iterations", iterations_);
    if (!iterations_.empty() && request.iterations == 0) {
      throw UsageError("--iterations must be positive");
    }
    request.seconds = seconds_.value_or(0.0);
    request.seed = common.seed;
    request.threads = common.threads;
    request.memory_bytes = common.memory_or(0);
    return request;
  }

  /// Returns the rows of the pairs and adds their number to `pairs`.
  std::string rows_of(const MatchOutcome& outcome, std::size_t& pairs) const {
    std::string text = std::string(kPairsHead) + '\n';
    for (std::uint32_t a = 0; a < outcome.mate.size(); ++a) {
      check_interrupt();
      const std::uint32_t b = outcome.mate[a];
      // The mate of an unmatched point is larger than all indices.
      if (b <= a || b >= outcome.mate.size()) continue;
      const stream::Point3 &p = positions_[a], &q = positions_[b];
      const double distance = base::hypot(base::hypot(p[0] - q[0], p[1] - q[1]), p[2] - q[2]);
      text += fmt::format("{},{},{}\n", a, b, number_text(distance));
      ++pairs;
    }
    return text;
  }

  /// Returns the boxes of a table's triangles. Replaces its positions (first corners) with
  /// centroids.
  [[nodiscard]] std::vector<base::Box3> to_centroids(PointTable& table) const {
    const CornerReader read(table.info, stream::Entities::triangles, input_);
    const std::size_t record = table.info.payload_size();
    std::vector<base::Box3> boxes(table.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      check_interrupt();
      std::array<stream::Point3, 3> corners{table.positions[i]};
      read(std::span(table.payload).subspan(i * record, record), corners);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto [low, high] =
            std::minmax({corners[0][axis], corners[1][axis], corners[2][axis]});
        boxes[i].min[axis] = low;
        boxes[i].max[axis] = high;
        table.positions[i][axis] =
            corners[0][axis] / 3 + corners[1][axis] / 3 + corners[2][axis] / 3;
      }
    }
    return boxes;
  }

  /// Returns the rows of a tree. `boxes` are those of the entities in the file's coordinates. If it
  /// is empty, the rows have no boxes.
  static std::string rows_of(const TreeOutcome& outcome, std::vector<base::Box3> boxes = {}) {
    const bool has_boxes = !boxes.empty();
    std::string text = std::string(has_boxes ? kBoxTreeHead : kTreeHead) + '\n';
    for (const matching::MatchingTreeRow& row : outcome.tree.rows) {
      check_interrupt();
      text += fmt::format("{},{},{},{},{}", row.a, row.b, number_text(row.distance), row.size,
                          row.level);
      if (has_boxes) {
        base::Box3 box = boxes[row.a];
        for (std::size_t axis = 0; axis < 3; ++axis) {
          box.min[axis] = std::min(box.min[axis], boxes[row.b].min[axis]);
          box.max[axis] = std::max(box.max[axis], boxes[row.b].max[axis]);
        }
        boxes.push_back(box);
        for (const double value : box.min) text += ',' + number_text(value);
        for (const double value : box.max) text += ',' + number_text(value);
      }
      text += '\n';
    }
    return text;
  }

  void write(const std::string& text, const stream::Naming& replace) const {
    stream::Sink file(output_, replace, stop_token());
    file.write(text);
    file.commit();
  }

  [[nodiscard]] Summary summary_of(const MatchOutcome& outcome, std::size_t pairs,
                                   const Stopwatch& watch) const {
    Summary summary;
    const auto unmatched = std::find(outcome.mate.begin(), outcome.mate.end(), matching::kNone);
    const bool odd = unmatched != outcome.mate.end();
    summary.json = {{"pairs", pairs},
                    {"cost", outcome.cost},
                    {"iterations", outcome.iterations},
                    {"unmatched", odd ? 1 : 0},
                    {"optimal", outcome.optimal},
                    {"clusters", outcome.clusters}};
    summary.json["left_over"] = nullptr;
    if (odd) summary.json["left_over"] = unmatched - outcome.mate.begin();
    summary.json["lower_bound"] = or_null(outcome.lower_bound);
    summary.text = counted(pairs, "pair") + ", total distance " + readable_number(outcome.cost, 6);
    summary.text += quality_text(outcome);
    if (odd) {
      summary.text += fmt::format(", point {} left over", unmatched - outcome.mate.begin());
    }
    finish_summary(summary, watch);
    return summary;
  }

  [[nodiscard]] Summary summary_of(const TreeOutcome& outcome, const Stopwatch& watch) const {
    double cost = 0.0;
    std::uint32_t levels = 0;
    for (const matching::MatchingTreeRow& row : outcome.tree.rows) {
      cost += row.distance;
      levels = std::max(levels, row.level);
    }
    Summary summary;
    summary.json = {{"pairs", outcome.tree.rows.size()},
                    {"cost", cost},
                    {"iterations", levels},
                    {"unmatched", 0},
                    {"levels", levels},
                    {"clusters", outcome.clusters}};
    summary.text = fmt::format("a tree of {} on {}, total distance {}",
                               counted(outcome.tree.rows.size(), "pair"), counted(levels, "level"),
                               readable_number(cost, 6));
    finish_summary(summary, watch);
    return summary;
  }

  /// Returns " (the optimum)" or the bound of the gap to it, for the summary.
  static std::string quality_text(const MatchOutcome& outcome) {
    if (outcome.optimal) return " (the optimum)";
    if (!outcome.lower_bound || !(*outcome.lower_bound > 0.0)) return " (no bound)";
    const double gap = std::max(0.0, outcome.cost / *outcome.lower_bound - 1.0);
    return " (at most " + readable_bound(100.0 * gap) + " % above the optimum)";
  }

  /// Adds the cost of the work and ends the text.
  void finish_summary(Summary& summary, const Stopwatch& watch) const {
    summary.add_cost(watch);
    summary.text += ", " + readable_seconds(watch.seconds()) + '\n';
    summary.text_is_result = output_ != "-";
  }

  std::vector<stream::Point3> positions_;
  std::string input_, output_, input_format_, method_ = "auto", iterations_, labels_,
                                              entities_ = "points";
  bool tree_ = false;
  std::optional<double> seconds_;
  double z_weight_ = 1;
};

}  // namespace

std::unique_ptr<Command> make_match() { return std::make_unique<MatchCommand>(); }

}  // namespace terrace::tools
