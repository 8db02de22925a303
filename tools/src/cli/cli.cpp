// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/cli.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <filesystem>
#include <new>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/cluster/linkage.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_names.hpp"
#include "cli/terminal.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"
#include "version.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;
constexpr int kInterrupted = 130;

std::string general_help() {
  std::string text =
      "terrace turns point sets too large for memory into a store, and serves any part of it at "
      "any\nresolution.\n\nUsage: terrace VERB [OPTIONS]\n\nVerbs:\n";
  for (const Verb& verb : verbs()) {
    text +=
        fmt::format("  {}{}{}\n", verb.name,
                    std::string(10 - std::min<std::size_t>(verb.name.size(), 9), ' '), verb.brief);
  }
  return text +
         "\n`terrace VERB --help` lists options; `terrace --version` shows version, build and "
         "parts.\n"
         "\nExample:\n  terrace synth dem --size 1024x1024 -o dem.tif\n";
}

std::string version_text() {
  const cluster::CudaStatus cuda = cluster::cuda_available();
  return fmt::format("terrace {}\nbuild: {}\nparts: linkage on a GPU: {}\n", kVersion, kBuild,
                     cuda.available ? cuda.device : "no GPU");
}

/// Planned verbs and options. Naming them here keeps users from taking them for typing errors.
constexpr std::array<std::string_view, 5> kPlannedVerbs{"plan", "remove", "compact", "vacuum",
                                                        "ground"};
constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kPlannedOptions{
    {{"build", "--plan"},
     {"build", "--part"},
     {"build", "--resume"},
     {"mesh", "--base"},
     {"points", "--max-points"}}};

void refuse_planned_options(const Verb& verb, std::span<const std::string> arguments) {
  for (const std::string& argument : arguments) {
    if (argument == "--") return;
    for (const auto& [name, option] : kPlannedOptions) {
      if (verb.name == name && argument.substr(0, argument.find('=')) == option) {
        throw UsageError(fmt::format("{} is not available yet", option));
      }
    }
  }
}

/// Returns the edit distance of two words: letters inserted, deleted, replaced or swapped with the
/// next.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, last(b.size() + 1), now(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    now[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      now[j] =
          std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        now[j] = std::min(now[j], before[j - 2] + 1);
      }
    }
    before = std::exchange(last, now);
  }
  return last[b.size()];
}

/// Returns "did you mean NAME? " for the name most similar to `word`, or an empty string if none
/// is.
std::string suggestion(std::string_view word, std::span<const std::string> names) {
  constexpr std::size_t kLongest = 40;  // no verb or option is longer
  if (word.size() > kLongest) return {};
  const std::string* nearest = nullptr;
  std::size_t least = word.size() / 3 + 1;  // almost all short words are one letter apart
  for (const std::string& name : names) {
    // A prefix of a name counts as one letter away.
    const std::size_t apart =
        word.size() > 3 && name.starts_with(word) ? 1 : edit_distance(word, name);
    if (apart >= least) continue;
    least = apart;
    nearest = &name;
  }
  return nearest == nullptr ? std::string() : "did you mean " + *nearest + "? ";
}

/// Returns "did you mean --NAME? " for an unknown option.
std::string suggested_option(const CLI::App& app, const std::string& argument) {
  if (!argument.starts_with("--")) return {};
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options({})) {
    for (const std::string& name : option->get_lnames()) names.push_back(fmt::format("--{}", name));
  }
  return suggestion(argument.substr(0, argument.find('=')), names);
}

/// Rejects empty values. They are mistakes, such as an unset shell variable; ignoring the option
/// would silently produce a different result.
void refuse_empty_values(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options({})) {
    const std::vector<std::string>& values = option->results();
    if (std::find(values.begin(), values.end(), "") != values.end()) {
      throw UsageError(option->get_name() + " is empty; give it a value or leave it out");
    }
  }
}

/// Minimum --memory of a verb in MiB: the process itself and the smallest buffers. Verbs that need
/// more for their input check that themselves.
constexpr std::uint64_t kMinMemory = 24;
constexpr std::array<std::pair<std::string_view, std::uint64_t>, 6> kMinMemoryOfVerbs{
    {{"cluster", 40},
     {"contour", 64},
     {"match", 40},
     {"profile", 48},
     {"raster", 64},
     {"sample", 64}}};

/// Refuses a --memory that is too small for any input.
void check_memory(const Verb& verb, const CommonOptions& common) {
  std::uint64_t min_mebibytes = kMinMemory;
  for (const auto& [name, mebibytes] : kMinMemoryOfVerbs) {
    if (name == verb.name) min_mebibytes = mebibytes;
  }
  if (!common.memory_bytes || *common.memory_bytes >= min_mebibytes << 20) return;
  throw std::runtime_error(
      fmt::format("--memory is {}, but `terrace {}` needs {} MiB at least; raise --memory",
                  readable_bytes(*common.memory_bytes), verb.name, min_mebibytes));
}

const Verb& find_verb(const std::string& name) {
  if (std::find(kPlannedVerbs.begin(), kPlannedVerbs.end(), name) != kPlannedVerbs.end())
    throw UsageError(fmt::format("the verb '{}' is not available yet", name));
  for (const Verb& verb : verbs()) {
    if (verb.name == name) return verb;
  }
  std::vector<std::string> names;
  for (const Verb& verb : verbs()) names.push_back(verb.name);
  throw UsageError(fmt::format("unknown verb '{}'; {}`terrace --help` lists them", name,
                               suggestion(name, names)));
}

/// Returns parse(text). Puts the option's name in front of the message of a UsageError.
template <class Parse>
std::uint64_t value_of_option(const std::string& name, const std::string& text,
                              const Parse& parse) {
  try {
    return parse(text);
  } catch (const UsageError& error) {
    throw UsageError(stream::message("{}: {}", name, error.message()));
  }
}

void add_common_options(CLI::App& app, CommonOptions& common) {
  const std::string group = "Common options";
  app.add_option("--threads", common.threads, "threads; never changes results (default: all cores)")
      ->check(CLI::Range(1U, 4096U))
      ->group(group)
      ->type_name("N");
  app.add_option_function<std::string>(
         "--memory",
         [&common](const std::string& text) {
           common.memory_bytes = value_of_option("--memory", text, parse_memory);
         },
         "memory limit, such as 256M or 2G; never changes results")
      ->group(group)
      ->type_name("SIZE");
  app.add_option_function<std::string>(
         "--seed",
         [&common](const std::string& text) { common.seed = count_of_option("--seed", text); },
         "same input, options and seed give the same bytes (default: 1)")
      ->group(group)
      ->type_name("N");
  app.add_flag("--json", common.json, "print the summary as one JSON object on standard output")
      ->group(group);
  app.add_flag("--force", common.force,
               "replace an existing output if terrace wrote it: a file with its mark or unchanged "
               "text, or a folder without files of other programs")
      ->group(group);
  app.add_option_function<std::string>(
         "--progress",
         [&common](const std::string& mode) {
           common.progress = mode == "json"   ? ProgressMode::json
                             : mode == "none" ? ProgressMode::none
                                              : ProgressMode::automatic;
         },
         "progress on standard error: auto (on a terminal), json (JSON lines) or none")
      ->check(CLI::IsMember({"auto", "json", "none"}))
      ->group(group)
      ->type_name("MODE");
  app.add_flag("-q,--quiet", common.quiet, "print nothing but errors")->group(group);
  app.add_flag("-v,--verbose", common.verbose, "explain each step")->group(group);
}

/// Returns true if -o, or its default, is '-'.
bool writes_to_stdout(const CLI::App& app) {
  const CLI::Option* output = app.get_option_no_throw("--output");
  if (output == nullptr) return false;
  return (output->count() > 0 ? output->as<std::string>() : output->get_default_str()) == "-";
}

/// Runs one verb with the arguments that follow its name.
int run_verb(const Verb& verb, std::vector<std::string> arguments) {
  CLI::App app{verb.brief.empty() ? "" : fmt::format("terrace {}: {}.", verb.name, verb.brief),
               "terrace " + verb.name};
  app.set_help_flag("-h,--help", "print this help")->group("Common options");
  app.footer(fmt::format("Example:\n  {}", verb.example));

  CommonOptions common;
  common.threads = std::max(1U, std::thread::hardware_concurrency());
  const std::unique_ptr<Command> command = verb.create();
  command->define(app);
  add_common_options(app, common);

  refuse_planned_options(verb, arguments);
  try {
    std::reverse(arguments.begin(), arguments.end());  // the order that CLI11 expects
    app.parse(std::move(arguments));
  } catch (const CLI::CallForHelp&) {
    print_result(app.help());
    return kDone;
  } catch (const CLI::ParseError& error) {
    // Report unknown arguments first: a missing option may be the misspelt one. Name only the
    // first, where CLI11 would list all: a shell pattern can expand to thousands of files.
    const std::vector<std::string> extras = app.remaining();
    const bool option = !extras.empty() && extras.front().starts_with("--");
    if (!option && dynamic_cast<const CLI::ExtrasError*>(&error) == nullptr) {
      throw UsageError(
          fmt::format("{}; `terrace {} --help` lists the options", error.what(), verb.name));
    }
    const std::size_t more = option ? 0 : extras.size() - 1;
    throw UsageError(
        fmt::format("'{}'{}: no such argument or option; {}`terrace {} --help` lists them",
                    extras.front(), more > 0 ? fmt::format(" and {} more", more) : "",
                    suggested_option(app, extras.front()), verb.name));
  }
  refuse_empty_values(app);
  if (common.json && writes_to_stdout(app)) {
    throw UsageError("--json and the output both go to standard output; give -o FILE");
  }
  if (common.quiet && common.progress == ProgressMode::automatic) {
    common.progress = ProgressMode::none;
  }

  check_memory(verb, common);
  const Summary summary = command->run(common);
  try {
    if (common.json) {
      // File names and texts in files may not be UTF-8. Escaping all non-ASCII characters also
      // escapes those that a terminal would act on.
      constexpr auto kReplace = nlohmann::ordered_json::error_handler_t::replace;
      print_result(summary.json.dump(-1, ' ', true, kReplace) + '\n');
    } else if (summary.text_is_result) {
      print_result(printable(summary.text));
    } else if (!common.quiet) {
      print_lines(summary.text);
    }
  } catch (const stream::ClosedPipe&) {
    // The reader of the summary has gone; the exit code still counts.
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
    throw UsageError(
        fmt::format("the verb comes first, then '{}'; `terrace --help` lists verbs", first));
  }
  return run_verb(find_verb(first), {arguments.begin() + 1, arguments.end()});
}

/// Returns the message after Ctrl-C, which says how to continue.
std::string stopped_message(std::string_view verb_name) {
  for (const Verb& verb : verbs()) {
    if (verb.name == verb_name && !verb.resumed_by.empty()) {
      return "interrupted; run the same command with " + verb.resumed_by + " to continue";
    }
  }
  return kStopped;
}

/// Returns the message to show. Those of the standard library are of little use to users.
std::string message_of(const std::exception& error) {
  if (const auto* fault = dynamic_cast<const stream::Error*>(&error)) {
    return option_text(fault->message());
  }
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) {
    return "out of memory; give a smaller --memory or a smaller input";
  }
  if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&error)) {
    const std::string& name = file->path1().string();
    return (name.empty() ? "" : name + ": ") + file->code().message();
  }
  const std::string text = error.what();
  // "vector::reserve" or "cannot create std::vector larger than max_size()": a size beyond any
  // memory.
  if (dynamic_cast<const std::length_error*>(&error) != nullptr &&
      (text.find("::") != std::string::npos || text.find("max_size") != std::string::npos)) {
    return "the result would not fit into any memory; request less";
  }
  return text;
}

/// Returns the number. Throws UsageError, which names the option.
double number_of_option(const std::string& name, const std::string& text,
                        const NumberRange& range) {
  const double value = parse_number(text, name);
  if (value < range.min || (range.min_is_excluded && value == range.min) || value > range.max) {
    const std::string expected =
        range.min_is_excluded ? fmt::format("above {}", plain_number(range.min))
        : std::isinf(range.max)
            ? fmt::format("at least {}", plain_number(range.min))
            : fmt::format("from {} to {}", plain_number(range.min), plain_number(range.max));
    throw UsageError(fmt::format("{} must be {}, not {}", name, expected, text));
  }
  return value;
}

template <class Value>
CLI::Option* add_any_number(CLI::App& app, const std::string& name, Value& value,
                            const std::string& description, const NumberRange& range) {
  return app
      .add_option_function<std::string>(
          name,
          [name, range, &value](const std::string& text) {
            value = number_of_option(name, text, range);
          },
          description)
      ->type_name("NUMBER");
}

}  // namespace

CLI::Option* add_number(CLI::App& app, const std::string& name, double& value,
                        const std::string& description, const NumberRange& range) {
  return add_any_number(app, name, value, description, range)->default_str(plain_number(value));
}

CLI::Option* add_number(CLI::App& app, const std::string& name, std::optional<double>& value,
                        const std::string& description, const NumberRange& range) {
  return add_any_number(app, name, value, description, range);
}

std::uint64_t count_of_option(const std::string& name, const std::string& text) {
  return value_of_option(name, text, parse_count);
}

CLI::Option* add_output(CLI::App& app, std::string& target, const std::string& description) {
  return app.add_option("-o,--output", target, description)->required()->type_name("FILE");
}

void add_input_format(CLI::App& app, std::string& target) {
  app.add_option("--input-format", target,
                 "format of the input (default: from its content, then its ending)")
      ->type_name("NAME");
}

void add_point_format(CLI::App& app, std::string& target) {
  app.add_option("--format", target,
                 "xyz, csv, ply, ply-ascii, las, laz or copc (default: from the ending)")
      ->type_name("NAME");
}

CLI::Option* add_rgb_encoding(CLI::App& app, stream::HeightsOfColour& target) {
  return app
      .add_option_function<std::string>(
          "--rgb",
          [&target](const std::string& name) {
            target = name == "mapbox" ? stream::HeightsOfColour::mapbox
                                      : stream::HeightsOfColour::terrarium;
          },
          "how the colours of a PNG encode heights: mapbox or terrarium")
      ->check(CLI::IsMember({"mapbox", "terrarium"}));
}

CLI::Option* add_skip_damaged(CLI::App& app, bool& target) {
  return app.add_flag("--skip-damaged", target,
                      "skip damaged chunks and nodes of LAZ, COPC and EPT, and missing points of a "
                      "truncated LAS; count them");
}

CLI::Option* add_source_cell_size(CLI::App& app, std::optional<double>& target) {
  return add_number(app, "--cell", target,
                    "cell size of rasters without georeferencing (PNG): the first cell's centre is "
                    "0,0, rows go down",
                    kPositive);
}

int run_command_line(int argc, const char* const* argv) {
  install_signal_handlers();
  try {
    return dispatch({argv + std::min(argc, 1), argv + argc});
  } catch (const stream::ClosedPipe&) {
    return kDone;
  } catch (const UsageError& error) {
    print_message(option_text(error.message()));
    return kWrongUsage;
  } catch (const std::invalid_argument& error) {  // a library rejected a parameter
    print_message(error.what());
    return kWrongUsage;
  } catch (const std::exception& error) {
    // A wait, read or write that Ctrl-C interrupted is not a failure.
    if (interrupted()) {
      print_message(stopped_message(argc > 1 ? argv[1] : ""));
      return kInterrupted;
    }
    print_message(message_of(error));
    return kFailed;
  }
}

}  // namespace terrace::tools
