// SPDX-License-Identifier: Apache-2.0
#include "earth/crs/datum_change.hpp"

#include <algorithm>
#include <cassert>
#include <string>

#include <GeographicLib/Math.hpp>

#include "base/units.hpp"
#include "earth/crs/proj_object.hpp"

namespace terrace::terrain {
DatumChange::DatumChange(const CrsDefinition& from, const CrsDefinition& to,
                         const std::optional<GeographicArea>& area) {
  if (same_datum(from, to)) return;
  if (!from.shift && !to.shift && add_operation(from, to, area)) return;
  // A shift leads to WGS 84. If the direct operation lacks a grid, one by way of WGS 84 may exist.
  const CrsDefinition wgs84 = definition_of_epsg(4326);
  possible_ = from.shift || to.shift || !(same_datum(from, wgs84) || same_datum(wgs84, to));
  if (!possible_) return;
  if (from.shift) {
    add_shift(from, false);
  } else if (!same_datum(from, wgs84)) {
    add_operation(from, wgs84, area);
  }
  if (to.shift) {
    add_shift(to, true);
  } else if (!same_datum(wgs84, to)) {
    add_operation(wgs84, to, area);
  }
}

void DatumChange::add_name(const std::string& name, double accuracy) {
  name_ += (name_.empty() ? "" : " + ") + name;
  if (accuracy < 0 || !accuracy_) {
    accuracy_.reset();
  } else {
    *accuracy_ += accuracy;
  }
}

void DatumChange::add_shift(const CrsDefinition& system, bool inverse) {
  const DatumShift& s = *system.shift;
  const auto shape = [](const Ellipsoid& e) {
    return " +a=" + number_text(e.semi_major) +
           (e.inverse_flattening == 0 ? " +b=" + number_text(e.semi_major)
                                      : " +rf=" + number_text(e.inverse_flattening));
  };
  const std::string text =
      "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=push +v_3 +step "
      "+proj=cart" +
      shape(system.ellipsoid) + " +step +proj=helmert +x=" + number_text(s[0]) +
      " +y=" + number_text(s[1]) + " +z=" + number_text(s[2]) + " +rx=" + number_text(s[3]) +
      " +ry=" + number_text(s[4]) + " +rz=" + number_text(s[5]) + " +s=" + number_text(s[6]) +
      " +convention=position_vector +step +inv +proj=cart" + shape(Ellipsoid{}) +
      " +step +proj=pop +v_3 +step +proj=unitconvert +xy_in=rad +xy_out=deg";
  steps_.push_back({.pipeline = ProjPipeline(text), .from = {}, .to = {}, .inverse = inverse});
  add_name("the shift given with the CRS", -1);
}

bool DatumChange::add_operation(const CrsDefinition& from, const CrsDefinition& to,
                                const std::optional<GeographicArea>& area) {
  const ProjObject source = proj_crs_of_text(from.base_wkt), target = proj_crs_of_text(to.base_wkt);
  OperationChoice choice = choose_operation(source.get(), target.get(), area);
  if (!choice.better.empty()) better_ += (better_.empty() ? "" : "; ") + choice.better;
  possible_ = possible_ && choice.found;
  if (!choice.found) return false;
  add_name(choice.name, choice.accuracy);
  if (choice.pipeline == "+proj=noop") return true;
  steps_.push_back({.pipeline = ProjPipeline(choice.pipeline),
                    .from = {from.degrees_per_unit, from.prime_meridian},
                    .to = {to.degrees_per_unit, to.prime_meridian}});
  return true;
}

std::string DatumChange::description() const {
  if (!possible_) return better_;
  std::string text = quoted_with_accuracy(name_, accuracy_.value_or(0));
  if (!better_.empty()) text += " (" + better_ + ")";
  return text;
}

void DatumChange::apply(const Step& step, bool forward, std::span<Point2> places) {
  const bool along = forward != step.inverse;
  const Frame &in = along ? step.from : step.to, &out = along ? step.to : step.from;
  for (Point2& p : places) {
    p = {(p[0] - in.prime_meridian) / in.degrees_per_unit, p[1] / in.degrees_per_unit};
  }
  if (along) {
    step.pipeline.forward(places);
  } else {
    step.pipeline.reverse(places);
  }
  for (Point2& p : places) {
    p = {GeographicLib::Math::AngNormalize(p[0] * out.degrees_per_unit + out.prime_meridian),
         p[1] * out.degrees_per_unit};
  }
}

void DatumChange::forward(std::span<Point2> places) const {
  assert(possible_);
  for (const Step& step : steps_) apply(step, true, places);
}

void DatumChange::reverse(std::span<Point2> places) const {
  assert(possible_);
  std::for_each(steps_.rbegin(), steps_.rend(),
                [&](const Step& step) { apply(step, false, places); });
}

}  // namespace terrace::terrain
