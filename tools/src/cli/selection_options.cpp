// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/selection_options.hpp"

#include <sstream>
#include <vector>

#include "cli/cli.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/region.hpp"

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
  app.add_option(
         "--region", region_,
         "only points inside a box in the CRS of the input; of COPC and EPT nothing else is "
         "read")
      ->type_name("MINX,MINY[,MINZ],MAXX,MAXY[,MAXZ]");
  add_number(app, "--resolution", resolution_,
             "of COPC and EPT only the points down to this spacing, in units of its CRS",
             kAboveZero);
  app.add_option("--keep", keep_, "only these attributes, or none")->type_name("NAME,NAME");
  app.add_option("--drop", drop_, "all attributes but these")->type_name("NAME,NAME");
}

stream::Selection SelectionOptions::selection() const {
  stream::Selection selection{.where = where_, .resolution = resolution_.value_or(0)};
  if (!region_.empty()) {
    const terrain::Region region = terrain::Region::parse(region_);
    if (!region.polygons().empty()) {
      throw terrain::UsageError("--region of what is read is a box, not a file of polygons: " +
                                region_);
    }
    selection.region = region.box();
  }
  if (!keep_.empty()) selection.keep = names_in(keep_, "--keep");
  if (!drop_.empty()) selection.drop = names_in(drop_, "--drop");
  return selection;
}

}  // namespace terrace::tools
