// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "serve/site.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class PublishCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("STORE", stores_, "the stores to show")->required();
    add_output(app, output_, "the folder to write: the viewer and copies of the stores");
    app.add_flag("--repack", repack_,
                 "write the clusters of each level along a space-filling curve, for fewer "
                 "requests; helps stores of unordered points");
  }

  Summary run(const CommonOptions& common) override {
    check_output_name(outputs::kSite, output_);
    const Stopwatch watch;
    std::vector<stream::Store> stores;
    for (const std::string& path : stores_) stores.push_back(open_store(path));
    const SiteSize size = publish(stores, output_, common.force, repack_ ? common.threads : 0);
    Summary summary;
    summary.json = {{"stores", stores.size()}, {"files", size.files}, {"bytes", size.bytes}};
    summary.add_cost(watch);
    summary.text = fmt::format("{}: {}, {}, in {}; copy the folder to any web server\n", output_,
                               counted(size.files, "file"), readable_bytes(size.bytes),
                               readable_seconds(watch.seconds()));
    return summary;
  }

 private:
  std::vector<std::string> stores_;
  std::string output_;
  bool repack_ = false;
};

}  // namespace

std::unique_ptr<Command> make_publish() { return std::make_unique<PublishCommand>(); }

}  // namespace terrace::tools
