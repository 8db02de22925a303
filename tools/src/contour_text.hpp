// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <terrace/stream/store.hpp>

#include "contour_run.hpp"
#include "coordinate_system.hpp"
#include "fixed_text.hpp"
#include "ground_slope.hpp"
#include "line_joiner.hpp"
#include "region.hpp"

namespace terrace::tools {

/// Contour lines of a store as a GeoJSON FeatureCollection (RFC 7946), higher ground on the right.
class ContourText {
 public:
  /// write: takes the text in large pieces. Throws: stream::Error if the store has no CRS.
  ContourText(const stream::Store& store, double interval,
              std::function<void(std::string_view)> write);

  /// line: in stored coordinates, higher ground on the left where the second one grows upwards.
  void add(const ContourLine& line);
  void finish();
  [[nodiscard]] const ContourOutcome& outcome() const { return outcome_; }

 private:
  CoordinateSystem system_;
  GroundSlope ground_;
  bool reverse_;  ///< higher ground is on the left in the CRS
  double interval_;
  std::function<void(std::string_view)> write_;
  FixedText degrees_;
  ContourOutcome outcome_;
  std::string text_;
  std::vector<Point2> places_;
};

}  // namespace terrace::tools
