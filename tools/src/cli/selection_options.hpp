// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <terrace/stream/source.hpp>

/// --where, --region, --resolution, --keep and --drop of what reads files.

namespace terrace::tools {

class SelectionOptions {
 public:
  void define(CLI::App& app);
  /// Throws: UsageError for a list or a region that makes no sense.
  [[nodiscard]] stream::Selection selection() const;

 private:
  std::string where_, region_, keep_, drop_;
  std::optional<double> resolution_;
};

/// --where: the condition on attributes.
void add_where(CLI::App& app, std::string& where);

}  // namespace terrace::tools
