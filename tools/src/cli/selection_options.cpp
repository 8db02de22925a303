// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/selection_options.hpp"

#include <iomanip>
#include <sstream>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <terrace/stream/input.hpp>

#include "cli/cli.hpp"
#include "cli/interrupt.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::tools {
namespace {

/// Splits "a,b" into names. Names in double quotes may contain commas. "none" gives an empty list.
std::vector<std::string> names_in(const std::string& text, const std::string& option) {
  std::vector<std::string> names;
  if (text == "none") return names;
  std::istringstream list(text);
  while (list.peek() != std::istringstream::traits_type::eof()) {
    std::string name;
    if (list.peek() == '"') {
      list >> std::quoted(name);
      if (list.get() != ',' && !list.eof()) {
        throw terrain::UsageError(fmt::format("{}: no comma after {} in '{}'", option, name, text));
      }
    } else {
      std::getline(list, name, ',');
    }
    if (name.empty())
      throw terrain::UsageError(fmt::format("{}: a name is empty in '{}'", option, text));
    names.push_back(name);
  }
  return names;
}

}  // namespace

void add_where(CLI::App& app, std::string& where) {
  app.add_option(
         "--where", where,
         "only points that satisfy this, as 'classification == 2 && return_number == last': "
         "attributes, x, y, z and numbers with ! * / + - < <= > >= == != && || ( )")
      ->type_name("CONDITION");
}

void SelectionOptions::define(CLI::App& app) {
  add_where(app, where_);
  app.add_option(
      "--region", region_,
      "only points inside: a box in the CRS of the input, minx,miny[,minz],maxx,maxy[,maxz], or "
      "a GeoJSON file of polygons; little else is read of rasters, COPC and EPT");
  app.add_option("--region-crs", region_crs_,
                 "CRS of the region: EPSG:n or a WKT file; x,y is lon,lat (default: the input's; "
                 "for GeoJSON the one that the file names, or else longitude and latitude)")
      ->needs("--region");
  add_number(app, "--resolution", resolution_,
             "COPC and EPT: only points down to this spacing, in units of the CRS", kPositive);
  app.add_option("--keep", keep_,
                 "only these attributes, or none; put a name with a comma in double quotes")
      ->type_name("NAME,NAME");
  app.add_option("--drop", drop_, "all attributes except these")->type_name("NAME,NAME");
}

terrain::RegionConversion SelectionOptions::conversion(
    std::span<const std::string> inputs, const stream::SourceOptions& reading,
    const std::optional<terrain::DatumShift>& shift, const terrain::Region& region) const {
  for (const std::string& input : inputs) {
    if (stream::reads_once(input)) {
      if (region_crs_.empty() && reading.crs) {
        stream::SourceInfo named;
        named.files = {input};
        named.crs = *reading.crs;
        return terrain::RegionConversion(named, {}, shift);
      }
      const bool region_names_crs = region.crs() && !region.crs()->name.empty();
      if (region_crs_.empty() && !region_names_crs) return {};
      throw terrain::UsageError(fmt::format(
          "{} needs the CRS of the input before it is read, but {} can be read only once; name a "
          "file",
          region_crs_.empty() ? "the crs of " + region.crs()->file : std::string("--region-crs"),
          input));
    }
  }
  return terrain::RegionConversion(stream::open_source(inputs, reading)->info(), region_crs_,
                                   shift);
}

stream::Selection SelectionOptions::selection(std::span<const std::string> inputs,
                                              const stream::SourceOptions& reading,
                                              const std::optional<terrain::DatumShift>& shift,
                                              const CommonOptions& common) const {
  stream::Selection selection{.where = where_, .resolution = resolution_.value_or(0)};
  if (!region_.empty()) {
    terrain::Region region = terrain::Region::parse(region_, stop_token());
    if (!region_crs_.empty() || terrain::RegionConversion::may_turn(region)) {
      terrain::RegionConversion converted = conversion(inputs, reading, shift, region);
      converted.on_note([&common](const std::string& line) { common.say(line); });
      region = converted(std::move(region));
      if (!converted.note().empty()) common.say(converted.note());
    }
    region.restrict(selection);
  }
  if (!keep_.empty()) selection.keep = names_in(keep_, "--keep");
  if (!drop_.empty()) selection.drop = names_in(drop_, "--drop");
  return selection;
}

}  // namespace terrace::tools
