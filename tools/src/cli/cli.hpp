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

/// Framework of the command line: the table of verbs, their common options, and error reporting.
/// Each verb is a Command in its own file, verb_NAME.cpp.

namespace terrace::tools {

/// The outcome of a verb: one JSON object for programs (plain numbers, SI units, bytes, seconds)
/// and a text for people. With --json the object goes to standard output. Otherwise the text goes
/// to standard error, or to standard output if it is the result itself (`info`).
struct Summary {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  std::string text;  ///< lines, each ended by '\n'
  bool text_is_result = false;
  int exit_code = 0;  ///< 1 if a check found a fault

  /// Adds the cost of the work: "seconds" and "peak_rss_bytes".
  void add_cost(const terrain::Stopwatch& watch);
};

/// Returns the value as JSON, or null for nullopt.
template <class T>
nlohmann::ordered_json or_null(const std::optional<T>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

/// Returns the peak resident set size of this process, in bytes.
std::uint64_t peak_rss_bytes();

/// Options common to all verbs.
struct CommonOptions {
  unsigned threads = 1;  ///< --threads; the command line's default is all cores
  std::optional<std::uint64_t> memory_bytes;  ///< --memory, if given
  std::uint64_t seed = 1;                     ///< --seed
  bool json = false;                          ///< --json
  bool quiet = false;                         ///< -q
  bool verbose = false;                       ///< -v
  bool force = false;                         ///< --force
  ProgressMode progress = ProgressMode::automatic;

  /// Returns --memory in bytes, or `default_bytes` if it is not given. 0 means half of the
  /// available memory.
  [[nodiscard]] std::uint64_t memory_or(std::uint64_t default_bytes) const;
  /// Returns the memory for one source in bytes: memory_or(0) minus kProgramMemory, divided by
  /// `divisor`, but at least 64 MiB. Above 64 MiB the amount does not change the order of a
  /// raster's cells.
  [[nodiscard]] std::uint64_t reading_memory(std::uint64_t divisor = 1) const;
  /// Prints a message on standard error, unless -q is given.
  void say(const stream::Message& line) const;
  /// Prints an explanation on standard error, only with -v.
  void say_verbose(const std::string& line) const;
  /// Returns the context for the libraries: progress and notes go to standard error, and Ctrl-C
  /// requests a stop. These options must outlive it.
  [[nodiscard]] terrain::Context context() const;
};

/// Memory for the program, PROJ's CRS database and blocks in flight, in bytes.
inline constexpr std::uint64_t kProgramMemory = std::uint64_t{32} << 20;
/// Default --memory of `synth`.
inline constexpr std::uint64_t kStreamingMemory = std::uint64_t{256} << 20;

/// A verb. define() adds its options, parsing fills in its members, then run() does the work.
class Command {
 public:
  virtual ~Command() = default;
  /// Adds the verb's own options and arguments.
  virtual void define(CLI::App& app) = 0;
  /// Does the work. Throws UsageError for invalid values (exit 2), stream::Error and other
  /// exceptions if the work fails (exit 1), and stream::Stopped on interruption (exit 130).
  virtual Summary run(const CommonOptions& common) = 0;
};

/// A row in the table of verbs.
struct Verb {
  std::string name;
  std::string brief;    ///< one line for the list of verbs
  std::string example;  ///< shown at the end of the verb's help
  std::unique_ptr<Command> (*create)() = nullptr;
  std::string resumed_by{};  ///< the option that resumes an interrupted run
};

/// Returns all verbs, in the order in which they are typically used.
std::span<const Verb> verbs();

/// The range of finite numbers that an option accepts.
struct NumberRange {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_is_excluded = false;
};
inline constexpr NumberRange kPositive{.min = 0.0, .min_is_excluded = true};
inline constexpr NumberRange kNonNegative{.min = 0.0};
/// Range of factors for lengths and costs, chosen so that products stay finite.
inline constexpr NumberRange kFactor{.min = 1e-12, .max = 1e12};
inline constexpr NumberRange kFactorOrZero{.min = 0.0, .max = 1e12};

/// Adds an option that takes a real number. The current `value` is its default, shown in the help.
CLI::Option* add_number(CLI::App& app, const std::string& name, double& value,
                        const std::string& description, const NumberRange& range = {});
/// Adds an option that takes a real number and has no default.
CLI::Option* add_number(CLI::App& app, const std::string& name, std::optional<double>& value,
                        const std::string& description, const NumberRange& range = {});

/// Parses the count given to an option. Throws UsageError, which names the option.
std::uint64_t count_of_option(const std::string& name, const std::string& text);

/// Adds the required option -o, --output, stored in `target`.
CLI::Option* add_output(CLI::App& app, std::string& target, const std::string& description);

/// Adds --input-format.
void add_input_format(CLI::App& app, std::string& target);
/// Adds --format, for point files.
void add_point_format(CLI::App& app, std::string& target);
/// Adds --rgb, stored in `target`.
CLI::Option* add_rgb_encoding(CLI::App& app, stream::HeightsOfColour& target);
/// Adds --skip-damaged, for laser data.
CLI::Option* add_skip_damaged(CLI::App& app, bool& target);
/// Adds --cell, the cell size of rasters without georeferencing.
CLI::Option* add_source_cell_size(CLI::App& app, std::optional<double>& target);

/// Runs the command line and returns the exit code. Never throws.
int run_command_line(int argc, const char* const* argv);

}  // namespace terrace::tools
