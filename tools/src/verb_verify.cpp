// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdint>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <terrace/stream/store.hpp>

#include "units.hpp"
#include "verbs.hpp"

namespace terrace::tools {
namespace {

class VerifyCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("STORE", store_, "the store to check")->required();
    not_yet(app, {"--store", "--max-error"});
  }

  Summary run(const CommonOptions& /*common*/) override {
    const Stopwatch watch;
    const stream::Store store = stream::Store::open(store_);
    Summary summary;
    nlohmann::ordered_json problems = nlohmann::ordered_json::array();
    const bool ok = store.verify([&](const stream::Problem& problem) {
      problems.push_back(
          {{"file", problem.file}, {"offset", problem.offset}, {"what", problem.what}});
      summary.text +=
          problem.file + ": byte " + std::to_string(problem.offset) + ": " + problem.what + "\n";
    });
    std::uint64_t clusters = 0;
    for (const stream::LevelInfo& level : store.levels()) clusters += level.clusters;
    summary.json = {
        {"ok", ok}, {"problems", problems}, {"clusters", clusters}, {"points", store.points()}};
    summary.text += std::string(ok ? "sound: " : "damaged: ") + with_commas(store.points()) +
                    " points in " + with_commas(clusters) + " clusters, " +
                    readable_bytes(store.bytes()) + ", checked in " +
                    readable_seconds(watch.seconds()) + "\n";
    summary.exit_code = ok ? 0 : 1;
    return summary;
  }

 private:
  std::string store_;
};

}  // namespace

std::unique_ptr<Command> make_verify() { return std::make_unique<VerifyCommand>(); }

}  // namespace terrace::tools
