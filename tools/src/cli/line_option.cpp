// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/line_option.hpp"

#include <fstream>

#include <nlohmann/json.hpp>

#include "base/units.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {
namespace {

/// depth guards against files made to exhaust the stack.
void collect_line(const nlohmann::json& object, int depth,
                  std::vector<std::vector<Point2>>& lines) {
  if (depth > 8) return;
  const std::string type = object.value("type", "");
  if (type == "Feature") return collect_line(object.at("geometry"), depth + 1, lines);
  if (type == "FeatureCollection") {
    for (const nlohmann::json& feature : object.at("features"))
      collect_line(feature, depth + 1, lines);
  } else if (type == "LineString") {
    lines.emplace_back();
    for (const nlohmann::json& p : object.at("coordinates")) {
      lines.back().push_back({p.at(0).get<double>(), p.at(1).get<double>()});
    }
  }
}

}  // namespace

std::vector<Point2> parse_line(const std::string& text) {
  const auto bad = [&](const std::string& cause) {
    return stream::Error({.file = text,
                          .where = {},
                          .cause = cause,
                          .remedy = "give x1,y1,x2,y2,... or a GeoJSON file with one LineString"});
  };
  std::vector<Point2> line;
  if (text.find(',') != std::string::npos &&
      text.find_first_not_of("0123456789+-.,eE ") == std::string::npos) {
    const std::vector<double> v = parse_numbers(text, "--line");
    if (v.size() < 4 || v.size() % 2 != 0) {
      throw UsageError("--line has " + std::to_string(v.size()) +
                       " numbers; write x1,y1,x2,y2 and more pairs if wanted");
    }
    for (std::size_t i = 0; i < v.size(); i += 2) line.push_back({v[i], v[i + 1]});
    return line;
  }
  std::ifstream file(text);
  if (!file) throw bad("neither places nor a file that can be read");
  std::vector<std::vector<Point2>> lines;
  try {
    collect_line(nlohmann::json::parse(file), 0, lines);
  } catch (const nlohmann::json::exception& error) {
    throw bad(std::string("is no GeoJSON (") + error.what() + ")");
  }
  if (lines.size() != 1) throw bad("holds " + std::to_string(lines.size()) + " lines");
  if (lines.front().size() < 2) throw bad("the line has fewer than two places");
  return lines.front();
}

}  // namespace terrace::tools
