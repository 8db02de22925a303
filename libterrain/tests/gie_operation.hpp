// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "earth/crs/coordinate_system.hpp"

namespace terrace::terrain::gie {

/// An operation of PROJ as systems of ours: steps from longitude and latitude to a plane and back.
class GieRun {
 public:
  /// Throws: CrsError for parameters that make no system. Where one is not ours there is no run,
  /// and `unknown` says what is not, shortly.
  static std::optional<GieRun> make(const std::string& operation, std::string& unknown);

  /// One place there, or back.
  [[nodiscard]] Point2 apply(Point2 place, bool inverse) const;
  /// Metres between two of the places that apply() gives (inverse: takes).
  [[nodiscard]] double distance(const Point2& a, const Point2& b, bool of_input) const;

 private:
  struct Step {
    CoordinateSystem system;
    bool from;  ///< the plane is what comes in
    bool shifted;
  };
  std::vector<Step> steps_;
};

}  // namespace terrace::terrain::gie
