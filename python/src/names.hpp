// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <terrace/cluster/facility_location.hpp>
#include <terrace/terrain/fill.hpp>
#include <terrace/tri/grid_tin.hpp>
#include <terrace/tri/interpolation.hpp>
#include <terrace/tri/point_tin.hpp>
#include <terrace/tri/smoothing.hpp>

/// The libraries' enumerators by their names in Python. All throw ValueError that lists the known
/// names.

namespace terrace::python {

tri::Interpolation interpolation_named(const std::string& name);
tri::TinQuality quality_named(const std::string& name);
tri::PointDuplicates duplicates_named(const std::string& name);
tri::Smoothing smoothing_named(const std::string& name);
terrain::Fill fill_named(const std::string& name);
cluster::Effort effort_named(const std::string& name);
cluster::FacilityStrategy strategy_named(const std::string& name);

}  // namespace terrace::python
