// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/selection_options.hpp"

#include <sstream>
#include <vector>

#include "terrace/terrain/error.hpp"

namespace terrace::tools {
namespace {

/// "a,b" to names; "none" to no name at all.
std::vector<std::string> names_in(const std::string& text, const std::string& option) {
  std::vector<std::string> names;
  if (text == "none") return names;
  std::istringstream list(text);
  for (std::string name; std::getline(list, name, ',');) {
    if (name.empty()) throw terrain::UsageError(option + ": a name is empty in '" + text + "'");
    names.push_back(name);
  }
  return names;
}

}  // namespace

void add_where(CLI::App& app, std::string& where) {
  app.add_option("--where", where,
                 "only points that meet this, as 'classification == 2 && return_number == last': "
                 "attributes, x, y, z and numbers with ! * / + - < <= > >= == != && || ( )")
      ->type_name("CONDITION");
}

void SelectionOptions::define(CLI::App& app) {
  add_where(app, where_);
  app.add_option("--keep", keep_, "only these attributes, or none")->type_name("NAME,NAME");
  app.add_option("--drop", drop_, "all attributes but these")->type_name("NAME,NAME");
}

stream::Selection SelectionOptions::selection() const {
  stream::Selection selection{.where = where_};
  if (!keep_.empty()) selection.keep = names_in(keep_, "--keep");
  if (!drop_.empty()) selection.drop = names_in(drop_, "--drop");
  return selection;
}

}  // namespace terrace::tools
