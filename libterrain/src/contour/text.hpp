// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <terrace/stream/store.hpp>

#include "base/fixed_text.hpp"
#include "contour/levels.hpp"
#include "contour/line_joiner.hpp"
#include "earth/geography.hpp"
#include "surface/ground_slope.hpp"
#include "terrace/terrain/contours.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Writes contour lines of a store as a GeoJSON FeatureCollection (RFC 7946), higher ground on the
/// right.
class ContourText {
 public:
  /// write: receives the text in large pieces. Throws: stream::Error if longitudes and latitudes
  /// are requested and the store has no CRS; add() and finish() also for a place without them.
  ContourText(const stream::Store& store, const ContourRequest& request, unsigned threads,
              std::function<void(std::string_view)> write);

  /// line: in stored coordinates, with higher ground on the left if y points upwards.
  void add(ContourLine&& line);
  void finish();
  [[nodiscard]] const ContourOutcome& outcome() const { return outcome_; }

 private:
  void append(std::string& text, const ContourLine& line, std::vector<Point2>& places) const;
  void flush();

  std::string file_, head_;
  GroundSlope ground_;
  std::optional<BoxGeography> geography_;  ///< nullopt: places stay in the store's CRS
  double middle_ = 0;                      ///< longitude of the store's middle; NaN if it has none
  bool reverse_;                           ///< higher ground is on the left in the CRS
  ContourLevels levels_;
  unsigned threads_;
  std::function<void(std::string_view)> write_;
  FixedText number_;
  ContourOutcome outcome_;
  std::vector<ContourLine> lines_;  ///< not yet written
  std::size_t points_ = 0;          ///< number of points of these lines
  std::vector<std::string> texts_;  ///< texts of pieces; their memory is reused
  bool first_ = true;
};

}  // namespace terrace::terrain
