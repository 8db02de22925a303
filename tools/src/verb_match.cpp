// SPDX-License-Identifier: GPL-3.0-or-later
// match: pairs the points of one file at the least total distance.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <terrace/matching/halving.hpp>
#include <terrace/matching/point_matching.hpp>

#include "error.hpp"
#include "interrupt.hpp"
#include "library_call.hpp"
#include "output.hpp"
#include "point_table.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "units.hpp"
#include "verbs.hpp"

namespace terrace::tools {
namespace {

class MatchCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("input", input_, "File of points (or cells); - is standard input")
        ->required()
        ->type_name("FILE");
    add_output(app, output_,
               "The pairs, rows a,b,distance: numbers of points in the order of the input, from 0, "
               "and metres; - is standard output");
    app.add_option("--input-format", input_format_, "Of the input (else its content, its ending)")
        ->type_name("NAME");
    app.add_option("--method", method_,
                   "auto or exact: the optimum; monotone: repeated halving, near it; monte-carlo: "
                   "random halving, as the thesis has it")
        ->check(CLI::IsMember({"auto", "exact", "monotone", "monte-carlo"}))
        ->capture_default_str()
        ->type_name("NAME");
    app.add_option("--iterations", iterations_,
                   "monotone, monte-carlo: at most so many (default: as many as points)")
        ->type_name("N");
    app.add_option("--seconds", seconds_, "monotone, monte-carlo: begin no iteration after")
        ->check(CLI::PositiveNumber)
        ->type_name("S");
    app.add_option("--z-weight", z_weight_, "How much heights count in a distance")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    not_yet(app, {"--tree", "--labels"});
  }

  Summary run(const CommonOptions& common) override {
    const Stopwatch watch;
    const bool halving = method_ == "monotone" || method_ == "monte-carlo";
    if (!halving && (!iterations_.empty() || seconds_ > 0)) {
      throw UsageError("--iterations and --seconds are for --method monotone and monte-carlo");
    }
    if (output_ == "-" && common.json)
      throw UsageError("--json and '-o -' both want standard output");
    const std::uint64_t iterations = iterations_.empty() ? 0 : parse_count(iterations_);
    if (!iterations_.empty() && iterations == 0) throw UsageError("--iterations must be positive");
    const bool replace = may_replace(output_, common.force);
    const PointTable table = read_point_table(input_, input_format_, common.memory_or(0), common);
    const GroundFrame ground = GroundFrame::of(table, z_weight_);
    if (!ground.assumption.empty()) common.explain(input_ + ": " + ground.assumption);
    positions_.resize(table.size());
    std::transform(table.positions.begin(), table.positions.end(), positions_.begin(), ground);

    Outcome outcome;
    call_library(input_, method_, [&] { outcome = halving ? halve(iterations, common) : solve(); });
    const std::size_t pairs = write_pairs(outcome, replace);
    return summary_of(outcome, pairs, watch);
  }

 private:
  struct Outcome {
    std::vector<std::uint32_t> mate;
    double cost = 0.0;
    std::uint64_t iterations = 0;
    std::optional<std::uint32_t> left_over;
    std::optional<double> lower_bound;
  };

  Outcome solve() const {
    matching::PointMatching matching = matching::match_points(positions_);
    Outcome outcome{
        std::move(matching.mate), matching.cost, matching.rounds, {}, matching.dual_bound};
    if (matching.left_over != matching::kNobody) outcome.left_over = matching.left_over;
    return outcome;
  }

  Outcome halve(std::uint64_t iterations, const CommonOptions& common) const {
    ProgressMeter meter(common.progress, "iterations");
    matching::HalvingOptions options;
    options.method =
        method_ == "monotone" ? matching::Halving::monotone : matching::Halving::monte_carlo;
    options.iterations = iterations;
    if (seconds_ > 0) options.seconds = seconds_;
    options.seed = common.seed;
    options.threads = common.threads;
    options.progress = [&](std::uint64_t done, std::uint64_t total, double) {
      check_interrupt();
      meter.update(done, static_cast<double>(done) / static_cast<double>(total));
      return true;
    };
    matching::HalvingMatching matching = matching::match_by_halving(positions_, options);
    Outcome outcome{std::move(matching.mate), matching.cost, matching.iterations, {}, {}};
    if (matching.left_over != matching::kNobody) outcome.left_over = matching.left_over;
    return outcome;
  }

  /// Returns the number of pairs.
  std::size_t write_pairs(const Outcome& outcome, bool replace) const {
    std::string text = "a,b,distance\n";
    std::size_t pairs = 0;
    for (std::uint32_t a = 0; a < outcome.mate.size(); ++a) {
      const std::uint32_t b = outcome.mate[a];
      // Who has no partner has a number above all.
      if (b <= a || b >= outcome.mate.size()) continue;
      const stream::Point3 &p = positions_[a], &q = positions_[b];
      const double distance = std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
      text += std::to_string(a) + ',' + std::to_string(b) + ',' + number_text(distance) + '\n';
      ++pairs;
    }
    if (output_ == "-") {
      std::cout << text;
      if (!std::cout.flush()) throw ClosedPipe();
    } else {
      stream::AtomicFile file(output_, replace);
      file.write(text);
      file.commit();
    }
    return pairs;
  }

  [[nodiscard]] Summary summary_of(const Outcome& outcome, std::size_t pairs,
                                   const Stopwatch& watch) const {
    Summary summary;
    summary.json = {{"pairs", pairs},
                    {"cost", outcome.cost},
                    {"iterations", outcome.iterations},
                    {"unmatched", outcome.left_over ? 1 : 0}};
    summary.json["left_over"] = nullptr;
    if (outcome.left_over) summary.json["left_over"] = *outcome.left_over;
    summary.json["lower_bound"] = nullptr;
    if (outcome.lower_bound) summary.json["lower_bound"] = *outcome.lower_bound;
    summary.json["seconds"] = watch.seconds();
    summary.json["peak_rss_bytes"] = peak_rss_bytes();
    char cost[32];
    std::snprintf(cost, sizeof cost, "%.9g", outcome.cost);
    summary.text = with_commas(pairs) + " pairs, total distance " + cost;
    summary.text += outcome.lower_bound ? " (the optimum)" : " (no bound)";
    if (outcome.left_over) {
      summary.text += ", point " + std::to_string(*outcome.left_over) + " left over";
    }
    summary.text += ", " + readable_seconds(watch.seconds()) + '\n';
    summary.text_is_result = output_ != "-";
    return summary;
  }

  std::vector<stream::Point3> positions_;
  std::string input_, output_, input_format_, method_ = "auto", iterations_;
  double seconds_ = 0, z_weight_ = 1;
};

}  // namespace

std::unique_ptr<Command> make_match() { return std::make_unique<MatchCommand>(); }

}  // namespace terrace::tools
