// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <terrace/cluster/cuda_linkage.hpp>
#include <unistd.h>

#include "error.hpp"
#include "interrupt.hpp"
#include "terrace/stream/error.hpp"
#include "units.hpp"
#include "version.hpp"

namespace terrace::tools {
namespace {

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;
constexpr int kInterrupted = 130;

/// `text` on standard output, all of it. Throws: ClosedPipe, stream::Error.
void print_result(const std::string& text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (written && std::fflush(stdout) == 0) return;
  const int error = errno;
  if (error == EPIPE) throw ClosedPipe();
  throw stream::system_error("standard output", "cannot write", error);
}

/// The one line an error is. Multi-line messages of libraries are joined.
void print_error(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  std::fprintf(stderr, "terrace: %s\n", text.c_str());
}

std::string general_help() {
  std::string text =
      "terrace turns point sets too large for memory into a store, and serves from it any part at "
      "any\nresolution.\n\nUsage: terrace VERB [OPTIONS]\n\nVerbs:\n";
  for (const Verb& verb : verbs()) {
    if (verb.create == nullptr) continue;
    text += "  " + verb.name + std::string(10 - std::min<std::size_t>(verb.name.size(), 9), ' ') +
            verb.brief + '\n';
  }
  return text +
         "\n`terrace VERB --help` tells more; `terrace --version` names version, build and parts.\n"
         "\nExample:\n  terrace synth dem --size 1024x1024 -o dem.tif\n";
}

std::string version_text() {
  const cluster::CudaStatus cuda = cluster::cuda_available();
  return std::string("terrace ") + kVersion + "\nbuild: " + kBuild +
         "\nparts: linkage on a GPU: " + (cuda.available ? cuda.device : cuda.reason) + "\n";
}

const Verb& find_verb(const std::string& name) {
  for (const Verb& verb : verbs()) {
    if (verb.name == name) {
      if (verb.create == nullptr) throw UsageError("'" + name + "' is not available yet");
      return verb;
    }
  }
  throw UsageError("there is no verb '" + name + "'; `terrace --help` lists them");
}

void add_common_options(CLI::App& app, CommonOptions& common, std::string& memory,
                        std::string& seed) {
  const std::string group = "Common options";
  app.add_option("--threads", common.threads, "Threads; never changes results (default: all cores)")
      ->check(CLI::Range(1U, 4096U))
      ->group(group)
      ->type_name("N");
  app.add_option("--memory", memory, "Most memory to use: 256M, 2G; never changes results")
      ->group(group)
      ->type_name("SIZE");
  app.add_option("--seed", seed, "Same input, options and seed give the same bytes (default: 1)")
      ->group(group)
      ->type_name("N");
  app.add_flag("--json", common.json, "Print the summary as one JSON object on standard output")
      ->group(group);
  app.add_flag("--force", common.force,
               "Replace an existing output if its format's own mark says that terrace wrote it")
      ->group(group);
  app.add_option_function<std::string>(
         "--progress",
         [&common](const std::string& mode) {
           common.progress = mode == "json"   ? ProgressMode::json
                             : mode == "none" ? ProgressMode::none
                                              : ProgressMode::automatic;
         },
         "Progress on standard error: auto (on a terminal), json (JSON lines) or none")
      ->check(CLI::IsMember({"auto", "json", "none"}))
      ->group(group)
      ->type_name("MODE");
  app.add_flag("-q,--quiet", common.quiet, "Print nothing but errors")->group(group);
  app.add_flag("-v,--verbose", common.verbose, "Explain what is done")->group(group);
}

/// Runs one verb with its arguments, those after the verb's name.
int run_verb(const Verb& verb, std::vector<std::string> arguments) {
  CLI::App app{verb.brief.empty() ? "" : "terrace " + verb.name + ": " + verb.brief + ".",
               "terrace " + verb.name};
  app.set_help_flag("-h,--help", "Print this help")->group("Common options");
  app.footer("Example:\n  " + verb.example);

  CommonOptions common;
  common.threads = std::max(1U, std::thread::hardware_concurrency());
  std::string memory, seed;
  const std::unique_ptr<Command> command = verb.create();
  command->define(app);
  add_common_options(app, common, memory, seed);

  try {
    std::reverse(arguments.begin(), arguments.end());  // as CLI11 takes them
    app.parse(std::move(arguments));
  } catch (const CLI::CallForHelp&) {
    print_result(app.help());
    return kDone;
  } catch (const CLI::ParseError& error) {
    throw UsageError(std::string(error.what()) + "; `terrace " + verb.name + " --help` tells more");
  }
  if (!memory.empty()) common.memory_bytes = parse_memory(memory);
  if (!seed.empty()) common.seed = parse_count(seed);
  if (common.quiet && common.progress == ProgressMode::automatic) {
    common.progress = ProgressMode::none;
  }

  const Summary summary = command->run(common);
  if (common.json) {
    print_result(summary.json.dump() + '\n');
  } else if (summary.text_is_result) {
    print_result(summary.text);
  } else if (!common.quiet) {
    std::fputs(summary.text.c_str(), stderr);
  }
  return summary.exit_code;
}

int dispatch(const std::vector<std::string>& arguments) {
  if (arguments.empty()) {
    throw UsageError("no verb given; `terrace --help` lists them");
  }
  const std::string& first = arguments.front();
  if (first == "--help" || first == "-h" || (first == "help" && arguments.size() == 1)) {
    print_result(general_help());
    return kDone;
  }
  if (first == "--version") {
    print_result(version_text());
    return kDone;
  }
  if (first == "help") return run_verb(find_verb(arguments[1]), {"--help"});
  if (first.size() > 1 && first.front() == '-') {
    throw UsageError("the verb comes first, then '" + first + "'; `terrace --help` lists verbs");
  }
  return run_verb(find_verb(first), {arguments.begin() + 1, arguments.end()});
}

}  // namespace

void not_yet(CLI::App& app, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    app.add_option_function<std::vector<std::string>>(
           name,
           [name](const std::vector<std::string>&) {
             throw UsageError(std::string("'") + name + "' is not available yet");
           })
        ->expected(0, 1)
        ->trigger_on_parse()
        ->group("");
  }
}

CLI::Option* add_output(CLI::App& app, std::string& target, const std::string& description) {
  return app.add_option("-o,--output", target, description)->required()->type_name("FILE");
}

int run_command_line(int argc, const char* const* argv) {
  install_signal_handlers();
  try {
    return dispatch({argv + std::min(argc, 1), argv + argc});
  } catch (const ClosedPipe&) {
    return kDone;
  } catch (const UsageError& error) {
    print_error(error.what());
    return kWrongUsage;
  } catch (const Interrupted& error) {
    print_error(error.what());
    return kInterrupted;
  } catch (const std::bad_alloc&) {
    print_error("out of memory; give a smaller --memory or a smaller input");
    return kFailed;
  } catch (const std::exception& error) {
    // A read or write that a signal cut short, or whose other end has gone, is not a fault.
    if (interrupted()) {
      print_error("interrupted; run the same command again to start anew");
      return kInterrupted;
    }
    if (stdout_closed()) return kDone;
    print_error(error.what());
    return kFailed;
  }
}

}  // namespace terrace::tools
