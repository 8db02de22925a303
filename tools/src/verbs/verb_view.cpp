// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <fmt/core.h>
#include <spawn.h>
#include <terrace/stream/store.hpp>
#include <unistd.h>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "serve/server.hpp"
#include "serve/site.hpp"
#include "verbs/verbs.hpp"

extern char** environ;

namespace terrace::tools {

using namespace terrain;
namespace {

/// Starts xdg-open, which opens the address in a browser and then exits. Returns false if it is not
/// installed; whether a browser opened is unknown.
bool open_browser(const std::string& address) {
  std::string program = "xdg-open", argument = address;
  char* const arguments[] = {program.data(), argument.data(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&actions, descriptor, "/dev/null", O_RDWR, 0);
  }
  pid_t child = 0;
  const int error = ::posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  return error == 0;
}

class ViewCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("STORE", stores_, "the stores to show")->required();
    app.add_option("--port", port_, "port on 127.0.0.1 (default: any free one)")
        ->check(CLI::Range(0, 65535))
        ->type_name("PORT");
    app.add_flag("--no-open", no_open_, "do not open a browser");
  }

  Summary run(const CommonOptions& common) override {
    LiveSite site(stores_, [](const std::string& path) { return open_store(path); });
    Server server([&site]() -> const Site& { return site.current(); },
                  static_cast<std::uint16_t>(port_));
    const std::string address =
        fmt::format("http://127.0.0.1:{}/?token={}", server.access().port, server.access().token);
    common.say(fmt::format("{} shows {} until Ctrl-C", address,
                           stores_.size() == 1 ? "the store" : counted(stores_.size(), "store")));
    if (!no_open_ && !open_browser(address)) {
      common.say("xdg-open not found; open the address in a browser yourself");
    }
    const Stopwatch watch;
    server.run([] { return interrupted(); });
    Summary summary;
    summary.json = {{"address", address}, {"stores", stores_.size()}};
    summary.add_cost(watch);
    return summary;
  }

 private:
  std::vector<std::string> stores_;
  int port_ = 0;
  bool no_open_ = false;
};

}  // namespace

std::unique_ptr<Command> make_view() { return std::make_unique<ViewCommand>(); }

}  // namespace terrace::tools
