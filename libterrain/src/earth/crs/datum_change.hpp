// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "earth/crs/definition.hpp"
#include "earth/crs/operation_choice.hpp"
#include "earth/crs/proj_pipeline.hpp"

namespace terrace::terrain {

/// The change from one datum to another, for longitudes (from Greenwich) and latitudes in degrees.
/// Uses a single operation for the whole area: the most accurate one in PROJ's database that is
/// valid there and whose grids are installed. A shift given with a system takes precedence.
/// Operations that ignore the difference between the datums ("ballpark") are never used.
///
/// Several threads may call const members at once.
class DatumChange {
 public:
  /// area: where the change is needed. By default, the area where both systems are used.
  DatumChange(const CrsDefinition& from, const CrsDefinition& to,
              const std::optional<GeographicArea>& area);

  /// Whether an operation exists.
  [[nodiscard]] bool possible() const { return possible_; }
  /// Whether coordinates stay unchanged.
  [[nodiscard]] bool identity() const { return steps_.empty(); }
  /// Accuracy in metres; nullopt if unknown, 0 within one datum.
  [[nodiscard]] std::optional<double> accuracy() const { return accuracy_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// Name, accuracy and, if one exists, a better operation that lacks a grid: "\"OSGB36 to WGS 84
  /// (6)\" within 2 m; ...".
  [[nodiscard]] std::string description() const;
  /// Names a better operation that lacks a grid, with its accuracy and the grid. Empty if there is
  /// none.
  [[nodiscard]] const std::string& better() const { return better_; }

  /// Convert in place. Require possible().
  void forward(std::span<Point2> places) const;
  void reverse(std::span<Point2> places) const;

 private:
  /// How the operation represents longitudes and latitudes.
  struct Frame {
    double degrees_per_unit = 1, prime_meridian = 0;
  };
  struct Step {
    ProjPipeline pipeline;
    Frame from, to;
    bool inverse = false;
  };
  void add_shift(const CrsDefinition& system, bool inverse);
  /// Adds an operation; returns false if there is none.
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
