// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <string>

#include "earth/crs/crs_geo_keys.hpp"
#include "earth/crs/crs_names.hpp"
#include "earth/crs/geo_key_values.hpp"

namespace terrace::terrain {

void check_geo_keys(const stream::Crs& crs, const CrsDefinition& definition) {
  using P = ProjectionParameters;
  using KeyKind = KeyOfParameter::Kind;
  const GeoKeyValues keys(crs);
  const std::string code = "EPSG:" + std::to_string(definition.epsg);
  const auto contradict = [&code](const std::string& what) {
    throw ContradictoryCrs("the GeoKeys contradict each other: " + code + " and " + what,
                           "say which is meant with --crs EPSG:n");
  };
  const int model = keys.code(1024);
  if ((model == 1 && !definition.method) || (model == 2 && definition.method)) {
    contradict(model == 1 ? "a projected model" : "a geographic model");
  }
  if (!definition.method && keys.code(3072) != 0 && keys.code(3072) != kUserDefined) {
    contradict("the projected CRS EPSG:" + std::to_string(keys.code(3072)));
  }
  if (!definition.method) return;
  const int base = keys.code(2048);
  if (base != 0 && base != kUserDefined && base != definition.base_epsg) {
    contradict("the geographic CRS EPSG:" + std::to_string(base));
  }
  const double unit = keys.metres_per_unit();
  if (unit != 0 && std::abs(unit / definition.metres_per_unit - 1) > 1e-9) {
    contradict("the unit of " + std::to_string(unit) + " metres");
  }
  const double angle = keys.degrees_per_unit();
  for (const KeyOfParameter& parameter : kParameterKeys) {
    const auto value = keys.number(parameter.key);
    // Methods keep the latitude of true scale and the skew in other keys; those are left out.
    const bool known = [&] {
      for (const ParameterName& name : method_name(*definition.method).parameters) {
        if (name.member == parameter.member) return true;
      }
      return false;
    }();
    if (!value || !known) continue;
    const double given = *value * (parameter.kind == KeyKind::angle                 ? angle
                                   : parameter.kind == KeyKind::length && unit != 0 ? unit
                                                                                    : 1.0);
    const ProjectionParameters& p = definition.parameters;
    const auto means = [given](double meant) {
      return std::abs(given - meant) <= 1e-8 * std::max({1.0, std::abs(given), std::abs(meant)});
    };
    // Two parallels mean the same in either order.
    const bool parallel = parameter.member == &P::parallel1 || parameter.member == &P::parallel2;
    if (!means(p.*parameter.member) && !(parallel && (means(p.parallel1) || means(p.parallel2)))) {
      contradict("GeoKey " + std::to_string(parameter.key) + " of " + std::to_string(*value));
    }
  }
}

}  // namespace terrace::terrain
