// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "cli/progress.hpp"
#include "cli/summary.hpp"
#include "terrace/stream/source.hpp"
#include "terrace/terrain/context.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

/// The frame of the command line: the table of verbs, the options that all of them have, and what
/// becomes of errors. A verb is one file, verb_NAME.cpp, with one Command.

namespace terrace::tools {

/// What every verb understands.
struct CommonOptions {
  unsigned threads = 1;                       ///< --threads; all cores unless given
  std::optional<std::uint64_t> memory_bytes;  ///< --memory, if given
  std::uint64_t seed = 1;                     ///< --seed
  bool json = false;                          ///< --json
  bool quiet = false;                         ///< -q
  bool verbose = false;                       ///< -v
  bool force = false;                         ///< --force
  ProgressMode progress = ProgressMode::automatic;

  /// --memory, or else what the verb grants itself: `standard`; 0 means half of what there is.
  [[nodiscard]] std::uint64_t memory_or(std::uint64_t standard) const;
  /// What a source may hold, one part in `parts` of memory_or(0) without the program itself: 64 MiB
  /// at least, from where on the order of a raster's cells does not depend on it.
  [[nodiscard]] std::uint64_t reading_memory(std::uint64_t parts = 1) const;
  /// A message to the user on standard error; not with -q.
  void say(const std::string& line) const;
  /// An explanation; only with -v.
  void explain(const std::string& line) const;
  /// What the libraries are given: progress and notes go to standard error, Ctrl-C asks to stop.
  /// These options must outlive it.
  [[nodiscard]] terrain::Context context() const;
};

/// The memory that `synth` takes unless --memory says otherwise.
inline constexpr std::uint64_t kStreamingMemory = std::uint64_t{256} << 20;

/// A verb. Life: constructed, define(), options parsed into its members, run().
class Command {
 public:
  virtual ~Command() = default;
  /// Adds the verb's own options and arguments.
  virtual void define(CLI::App& app) = 0;
  /// Does the work. Throws: UsageError for values that make no sense (exit 2), stream::Error and
  /// other exceptions for failed work (exit 1), Interrupted (exit 130).
  virtual Summary run(const CommonOptions& common) = 0;
};

/// A row of the table of verbs.
struct Verb {
  std::string name;
  std::string brief;                               ///< one line for the list of verbs
  std::string example;                             ///< ends the verb's help
  std::unique_ptr<Command> (*create)() = nullptr;  ///< nullptr: not available yet
};

/// All verbs of the contract, those that are not available yet among them.
std::span<const Verb> verbs();

/// Options of the contract that do not work yet: refused with exit 2, hidden from the help.
void not_yet(CLI::App& app, std::initializer_list<const char*> names);

/// The numbers that an option takes: finite, and not outside these.
struct NumberRange {
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  bool above_least = false;  ///< the least itself is outside
};
inline constexpr NumberRange kAboveZero{.least = 0.0, .above_least = true};
inline constexpr NumberRange kNotNegative{.least = 0.0};
/// Range of factors of lengths and costs: products stay finite.
inline constexpr NumberRange kFactor{.least = 1e-12, .most = 1e12};
inline constexpr NumberRange kFactorOrZero{.least = 0.0, .most = 1e12};

/// The one way in which an option takes a real number. `value` is its default, shown in the help.
CLI::Option* add_number(CLI::App& app, const std::string& name, double& value,
                        const std::string& description, const NumberRange& range = {});
/// Without a default.
CLI::Option* add_number(CLI::App& app, const std::string& name, std::optional<double>& value,
                        const std::string& description, const NumberRange& range = {});

/// parse_count() for an option, which its UsageError names.
std::uint64_t count_of_option(const std::string& name, const std::string& text);

/// The option -o, --output: required, kept in `target`.
CLI::Option* add_output(CLI::App& app, std::string& target, const std::string& description);

/// The option --rgb, kept in `target`.
CLI::Option* add_heights_of_colour(CLI::App& app, stream::HeightsOfColour& target);
/// --skip-damaged, of laser data.
CLI::Option* add_skip_damaged(CLI::App& app, bool& target);
/// --cell, the size of cells of rasters that do not say it.
CLI::Option* add_cell_of_source(CLI::App& app, std::optional<double>& target);

/// Runs the command line and returns the exit code. Never throws.
int run_command_line(int argc, const char* const* argv);

}  // namespace terrace::tools
