// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "earth/crs/crs_definition.hpp"
#include "earth/crs/operation_choice.hpp"
#include "earth/crs/proj_pipeline.hpp"

namespace terrace::terrain {

/// The way from one datum to another, for longitudes (from Greenwich) and latitudes in degrees: of
/// the operations of PROJ's database the most accurate in an area whose grids are installed, one
/// for the whole area. A shift that was said beside a system goes before them. Operations that
/// ignore the difference between the datums ("ballpark") are never taken.
///
/// Const members may be called by several threads at once.
class DatumChange {
 public:
  /// area: where it is needed; without it, where both systems are used.
  DatumChange(const CrsDefinition& from, const CrsDefinition& to,
              const std::optional<GeographicArea>& area);

  /// Whether there is a way at all.
  [[nodiscard]] bool possible() const { return possible_; }
  /// Whether coordinates stay as they are.
  [[nodiscard]] bool identity() const { return steps_.empty(); }
  /// Metres; nothing if it is not known. 0 for one datum.
  [[nodiscard]] std::optional<double> accuracy() const { return accuracy_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// Name, accuracy, and a better one that lacks a grid: "\"OSGB36 to WGS 84 (6)\" within 2 m;
  /// ...".
  [[nodiscard]] std::string description() const;
  /// A better one that lacks a grid, with its accuracy and the grid; may be empty.
  [[nodiscard]] const std::string& better() const { return better_; }

  /// In place. Only if it is possible.
  void forward(std::span<Point2> places) const;
  void reverse(std::span<Point2> places) const;

 private:
  /// Longitudes and latitudes as the operation takes and gives them.
  struct Frame {
    double degrees_per_unit = 1, prime_meridian = 0;
  };
  struct Step {
    ProjPipeline pipeline;
    Frame from, to;
    bool inverse = false;
  };
  void add_shift(const CrsDefinition& system, bool inverse);
  /// Whether there is one.
  bool add_operation(const CrsDefinition& from, const CrsDefinition& to,
                     const std::optional<GeographicArea>& area);
  void add_name(const std::string& name, double accuracy);
  static void apply(const Step& step, bool forward, std::span<Point2> places);

  std::vector<Step> steps_;
  bool possible_ = true;
  std::string name_, better_;
  std::optional<double> accuracy_ = 0.0;
};

}  // namespace terrace::terrain
