// SPDX-License-Identifier: GPL-3.0-or-later
#include "gie_parameters.hpp"

#include <cmath>
#include <functional>
#include <sstream>

#include "gie_file.hpp"

namespace terrace::terrain::gie {
namespace {

// As PROJ has them.
const std::map<std::string, Ellipsoid, std::less<>> kEllipsoids{
    {"GRS80", {6378137, 298.257222101}},
    {"WGS84", {6378137, 298.257223563}},
    {"bessel", {6377397.155, 299.1528128}},
    {"intl", {6378388, 297}},
    {"clrk66", {6378206.4, 6378206.4 / (6378206.4 - 6356583.8)}},
    {"sphere", {6370997, 0}}};

}  // namespace

void GieParameters::add(const std::string& word) {
  const std::size_t sign = word.find('='), plus = word[0] == '+' ? 1 : 0;
  values_.try_emplace(word.substr(plus, sign - plus),
                      sign == word.npos ? "" : word.substr(sign + 1));
}

std::string GieParameters::text(const std::string& name) const {
  const auto found = values_.find(name);
  return found == values_.end() ? std::string() : found->second;
}

std::optional<double> GieParameters::number(const std::string& name) const {
  return has(name) ? gie_number(text(name)) : std::nullopt;
}

GieSteps::GieSteps(const std::string& operation) : steps(1) {
  // "x = 1, 2, 3" is "x=1,2,3".
  std::string text;
  for (const char c : operation) {
    const bool joins = c == '=' || c == ',';
    while (joins && !text.empty() && text.back() == ' ') text.pop_back();
    if (c != ' ' || (!text.empty() && text.back() != '=' && text.back() != ',')) text += c;
  }
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const bool method = word.starts_with("proj=") || word.starts_with("+proj=");
    if (method && steps.size() == 1 && steps.front().has("proj")) {
      throw Unknown{"a malformed pipeline"};
    }
    if (word == "step" || word == "+step") {
      steps.emplace_back();
    } else {
      steps.back().add(word);
    }
  }
  pipeline = steps.size() > 1;
  if (!pipeline) return;
  const GieParameters common = steps.front();
  steps.erase(steps.begin());
  for (GieParameters& step : steps) {
    for (const auto& [key, value] : common.values()) {
      if (key != "proj") step.add(key + '=' + value);
    }
  }
}

void read_gie_ellipsoid(const GieParameters& p, CrsDefinition& definition) {
  Ellipsoid& e = definition.ellipsoid;
  const std::string datum = p.text("datum");
  if (datum == "GGRS87") {
    e = kEllipsoids.at("GRS80");
    definition.shift = DatumShift{-199.87, 74.79, 246.62};
  } else if (!datum.empty() && datum != "WGS84") {
    throw Unknown{"datum=" + datum};
  }
  if (p.has("ellps")) {
    const auto found = kEllipsoids.find(p.text("ellps"));
    if (found == kEllipsoids.end()) throw Unknown{"ellps=" + p.text("ellps")};
    e = found->second;
  } else if (datum.empty()) {
    e = kEllipsoids.at("GRS80");  // what PROJ takes without any
  }
  const bool shaped = p.has("b") || p.has("rf") || p.has("f") || p.has("es");
  if (const auto a = p.number("a")) e = {*a, shaped ? e.inverse_flattening : 0.0};
  if (const auto f = p.number("f")) e.inverse_flattening = *f == 0 ? 0 : 1 / *f;
  if (const auto rf = p.number("rf")) e.inverse_flattening = *rf;
  if (const auto es = p.number("es")) {
    e.inverse_flattening = *es == 0 ? 0 : 1 / (1 - std::sqrt(1 - *es));
  }
  if (const auto b = p.number("b")) {
    e.inverse_flattening = *b == e.semi_major ? 0 : e.semi_major / (e.semi_major - *b);
  }
  if (const auto radius = p.number("R")) e = {*radius, 0};
  if (!(e.semi_major > 0) || !(e.flattening() >= 0 && e.flattening() < 1) ||
      p.number("rf") == 0.0) {
    throw Unknown{"an ellipsoid of no size or shape"};
  }
  // PROJ refuses these; ours are their limits.
  if (p.text("proj") == "ups" && e.flattening() == 0) throw Unknown{"ups on a sphere"};
  if (p.text("proj") == "utm" && e.flattening() == 0) throw Unknown{"utm on a sphere"};
  // The two series differ from elliptic functions, PROJ's by 2 mm, ours by 1 mm.
  if (p.text("proj") == "utm" && e.flattening() > 0.01)
    throw Unknown{"utm on a flattening of 1/17"};
  if (p.has("towgs84")) {
    DatumShift shift{};
    std::istringstream list(p.text("towgs84"));
    std::size_t count = 0;
    for (std::string value; std::getline(list, value, ',') && count < 7;) {
      shift[count++] = gie_number(value).value();
    }
    definition.shift = shift;
  }
}

double gie_metres_per_unit(const GieParameters& p) {
  if (const std::string text = p.text("to_meter"); !text.empty()) {
    const std::size_t slash = text.find('/');
    const double below = slash == text.npos ? 1 : gie_number(text.substr(slash + 1)).value();
    const double unit = gie_number(text.substr(0, slash)).value() / below;
    if (!(unit > 0) || !std::isfinite(unit)) throw Unknown{"to_meter=" + text};
    return unit;
  }
  const std::string unit = p.text("units");
  if (unit.empty() || unit == "m") return 1;
  if (unit == "us-ft") return 1200.0 / 3937.0;
  if (unit == "km") return 1000;
  throw Unknown{"units=" + unit};
}

}  // namespace terrace::terrain::gie
