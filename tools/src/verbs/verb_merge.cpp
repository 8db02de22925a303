// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/stream/error.hpp>

#include "base/units.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/merge.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class MergeCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("STORE", stores_, "the stores to join; they stay as they are")->required();
    add_output(app, output_, "the store to write");
  }

  Summary run(const CommonOptions& common) override {
    check_output_name(outputs::kStore, output_);
    MergeRequest request;
    request.stores.assign(stores_.begin(), stores_.end());
    request.store = output_;
    request.replace = common.force;
    std::error_code ignored;
    for (const std::filesystem::path& store : request.stores) {
      if (std::filesystem::equivalent(store, request.store, ignored)) {
        throw UsageError(fmt::format("{} cannot be both joined and written", output_));
      }
    }
    if (!common.force && std::filesystem::exists(request.store, ignored)) {
      throw stream::Error(output_, "exists already")
          .remedy("name another output, or give --force to replace it");
    }
    const Stopwatch watch;
    const MergeOutcome outcome = merge_stores(request, common.context());
    Summary summary;
    summary.json = {{"points", outcome.points},          {"stores", stores_.size()},
                    {"levels", outcome.top + 1},         {"segments", outcome.segments},
                    {"clusters", outcome.clusters},      {"new_clusters", outcome.new_clusters},
                    {"store_bytes", outcome.store_bytes}};
    summary.add_cost(watch);
    summary.text = fmt::format(
        "{}: {} of {} stores, {}, {}, in {}\n{} taken over, {} made of the points of their roots\n",
        output_, counted(outcome.points, "point"), stores_.size(),
        counted(outcome.top + 1, "level"), readable_bytes(outcome.store_bytes),
        readable_seconds(watch.seconds()), counted(outcome.clusters, "cluster"),
        with_commas(outcome.new_clusters));
    return summary;
  }

 private:
  std::vector<std::string> stores_;
  std::string output_;
};

}  // namespace

std::unique_ptr<Command> make_merge() { return std::make_unique<MergeCommand>(); }

}  // namespace terrace::tools
