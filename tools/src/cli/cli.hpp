// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "base/stopwatch.hpp"
#include "cli/progress.hpp"
#include "terrace/stream/source.hpp"
#include "terrace/terrain/context.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

/// The frame of the command line: the table of verbs, their common options, and the reporting of
/// errors. A verb is one file, verb_NAME.cpp, with one Command.

namespace terrace::tools {

using namespace terrain;

/// How a verb ends: one JSON object for programs (plain numbers, SI units, bytes, seconds) and a
/// text for people. With --json the object goes to standard output; else the text to standard
/// error, or to standard output where it is what was asked for (`info`).
struct Summary {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  std::string text;  ///< lines, each ended by '\n'
  bool text_is_result = false;
  int exit_code = 0;  ///< 1 where a check found a fault

  /// Adds what the work cost: "seconds" and "peak_rss_bytes".
  void add_cost(const Stopwatch& watch);
};

/// null for nullopt.
template <class T>
nlohmann::ordered_json or_null(const std::optional<T>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

/// Largest resident set of this process so far.
std::uint64_t peak_rss_bytes();

/// The options that every verb has.
struct CommonOptions {
  unsigned threads = 1;                       ///< --threads; all cores unless given
  std::optional<std::uint64_t> memory_bytes;  ///< --memory, if given
  std::uint64_t seed = 1;                     ///< --seed
  bool json = false;                          ///< --json
  bool quiet = false;                         ///< -q
  bool verbose = false;                       ///< -v
  bool force = false;                         ///< --force
  ProgressMode progress = ProgressMode::automatic;

  /// --memory, or else the verb's default `standard`; 0 stands for half of the available memory.
  [[nodiscard]] std::uint64_t memory_or(std::uint64_t standard) const;
  /// What a source may hold, one part in `parts` of memory_or(0) without the program itself: 64 MiB
  /// at least, from where on the order of a raster's cells does not depend on it.
  [[nodiscard]] std::uint64_t reading_memory(std::uint64_t parts = 1) const;
  /// A message to the user on standard error; not with -q.
  void say(const std::string& line) const;
  /// An explanation; only with -v.
  void explain(const std::string& line) const;
  /// The context for the libraries: progress and notes go to standard error, Ctrl-C asks to stop.
  /// These options must outlive it.
  [[nodiscard]] terrain::Context context() const;
};

/// The memory of the program itself, of what PROJ reads to tell a CRS, and of the blocks in flight.
inline constexpr std::uint64_t kProgramMemory = std::uint64_t{32} << 20;
/// The memory that `synth` takes unless --memory says otherwise.
inline constexpr std::uint64_t kStreamingMemory = std::uint64_t{256} << 20;

/// A verb. Life: constructed, define(), options parsed into its members, run().
class Command {
 public:
  virtual ~Command() = default;
  /// Adds the verb's own options and arguments.
  virtual void define(CLI::App& app) = 0;
  /// Does the work. Throws: UsageError for values that make no sense (exit 2), stream::Error and
  /// other exceptions for failed work (exit 1), stream::Stopped (exit 130).
  virtual Summary run(const CommonOptions& common) = 0;
};

/// A row of the table of verbs.
struct Verb {
  std::string name;
  std::string brief;    ///< one line for the list of verbs
  std::string example;  ///< ends the verb's help
  std::unique_ptr<Command> (*create)() = nullptr;
  std::string resumed_by{};  ///< the option that goes on with an interrupted run
};

/// In the order of use.
std::span<const Verb> verbs();

/// The finite numbers that an option takes.
struct NumberRange {
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  bool above_least = false;  ///< excludes `least`
};
inline constexpr NumberRange kAboveZero{.least = 0.0, .above_least = true};
inline constexpr NumberRange kNotNegative{.least = 0.0};
/// Range of factors of lengths and costs: products stay finite.
inline constexpr NumberRange kFactor{.least = 1e-12, .most = 1e12};
inline constexpr NumberRange kFactorOrZero{.least = 0.0, .most = 1e12};

/// Adds an option that takes a real number. `value` is its default, shown in the help.
CLI::Option* add_number(CLI::App& app, const std::string& name, double& value,
                        const std::string& description, const NumberRange& range = {});
/// Without a default.
CLI::Option* add_number(CLI::App& app, const std::string& name, std::optional<double>& value,
                        const std::string& description, const NumberRange& range = {});

/// parse_count() for an option; its UsageError names the option.
std::uint64_t count_of_option(const std::string& name, const std::string& text);

/// The option -o, --output: required, kept in `target`.
CLI::Option* add_output(CLI::App& app, std::string& target, const std::string& description);

/// --input-format.
void add_input_format(CLI::App& app, std::string& target);
/// --format, of a file of points.
void add_point_format(CLI::App& app, std::string& target);
/// The option --rgb, kept in `target`.
CLI::Option* add_heights_of_colour(CLI::App& app, stream::HeightsOfColour& target);
/// --skip-damaged, of laser data.
CLI::Option* add_skip_damaged(CLI::App& app, bool& target);
/// --cell, the cell size of rasters without georeferencing.
CLI::Option* add_cell_of_source(CLI::App& app, std::optional<double>& target);

/// Runs the command line and returns the exit code. Never throws.
int run_command_line(int argc, const char* const* argv);

}  // namespace terrace::tools
