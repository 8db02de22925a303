// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "earth/crs/crs_definition.hpp"

/// The words of PROJ's operations.

namespace terrace::terrain::gie {

/// Thrown for what is not ours, which it names shortly.
struct Unknown {
  std::string what;
};

/// The parameters of one step; those without a value have an empty one.
class GieParameters {
 public:
  /// "+name=value", with or without the sign and the value; the first of a name counts.
  void add(const std::string& word);
  [[nodiscard]] bool has(const std::string& name) const { return values_.contains(name); }
  [[nodiscard]] std::string text(const std::string& name) const;
  [[nodiscard]] std::optional<double> number(const std::string& name) const;
  [[nodiscard]] double number(const std::string& name, double otherwise) const {
    return number(name).value_or(otherwise);
  }
  [[nodiscard]] const std::map<std::string, std::string>& values() const { return values_; }

 private:
  std::map<std::string, std::string> values_;
};

/// The steps of an operation, those of a pipeline with what is common to all; one step is no
/// pipeline. Throws: Unknown for a pipeline that PROJ refuses by its form.
struct GieSteps {
  explicit GieSteps(const std::string& operation);
  bool pipeline = false;
  std::vector<GieParameters> steps;
};

/// Sets ellipsoid and shift. Throws: Unknown.
void read_gie_ellipsoid(const GieParameters& p, CrsDefinition& definition);
/// Metres in the unit of the plane. Throws: Unknown.
double gie_metres_per_unit(const GieParameters& p);

}  // namespace terrace::terrain::gie
