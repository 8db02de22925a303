// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include <CLI/CLI.hpp>
#include <terrace/stream/source.hpp>

/// --where, --keep and --drop of what reads files.

namespace terrace::tools {

class SelectionOptions {
 public:
  void define(CLI::App& app);
  [[nodiscard]] stream::Selection selection() const;

 private:
  std::string where_, keep_, drop_;
};

/// --where: the condition on attributes.
void add_where(CLI::App& app, std::string& where);

}  // namespace terrace::tools
