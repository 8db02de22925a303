// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/point_file_crs.hpp"

#include "base/store_checks.hpp"
#include "earth/crs/definition.hpp"
#include "earth/ground.hpp"
#include "terrace/stream/unit_words.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {
namespace {

/// Returns the unit of heights that Ground uses. Returns an empty string if nothing is converted
/// and no unit is known, because readers of the file then make the same assumption.
std::string unit_of_heights(const stream::Placement& placement, bool converted) {
  if (!placement.coordinates[2].unit.empty()) return placement.coordinates[2].unit;
  if (!placement.crs.vertical_unit.empty()) return placement.crs.vertical_unit;
  if (converted) return Ground(placement).height_unit();
  const std::optional<CrsDefinition> definition = definition_of(placement.crs);
  return definition && definition->metres_per_height != 0
             ? recorded_unit(definition->metres_per_height)
             : std::string();
}

/// Returns the definition to record; nullopt for a local system. Throws: CrsError.
std::optional<CrsDefinition> definition_in_file(const stream::Placement& placement,
                                                const std::optional<stream::Crs>& other) {
  stream::Crs crs = placement.crs;
  crs.vertical_unit.clear();  // the WKT or code decides
  std::optional<CrsDefinition> definition = definition_of(crs);
  if (!other) return definition;
  std::optional<CrsDefinition> written = definition_of(*other);
  if (!written) return written;
  forget_heights(*written);
  if (!definition) return written;
  written->heights = definition->heights;
  if (definition->heights == Heights::orthometric) {
    written->height_wkt = definition->height_wkt;
    written->vertical_name = definition->vertical_name;
    written->vertical_epsg = definition->vertical_epsg;
    written->metres_per_height = definition->metres_per_height;
  }
  return written;
}

}  // namespace

stream::Crs crs_of_point_file(const stream::Placement& placement,
                              const std::optional<stream::Crs>& other,
                              const std::string& vertical) {
  stream::Crs crs = other.value_or(placement.crs);
  try {
    const std::string unit = unit_of_heights(placement, other.has_value());
    crs.vertical_unit = stream::canonical_unit(unit);
    const std::optional<double> metres = metres_in_unit(unit);
    std::optional<CrsDefinition> definition = definition_in_file(placement, other);
    if (definition) {
      if (vertical == name_of(Heights::ellipsoidal) &&
          definition->heights != Heights::ellipsoidal) {
        forget_heights(*definition);
        definition->heights = Heights::ellipsoidal;
      }
      // Without a unit, readers assume metres for heights, unless x and y are in feet.
      const bool assumed = definition->geographic || definition->metres_per_unit >= 1;
      const bool states_unit = definition->metres_per_height != 0;
      // The vertical system that has the unit also says that heights are ellipsoidal.
      const bool unsaid =
          definition->heights == Heights::ellipsoidal && definition->height_wkt.empty();
      if (metres && (states_unit || unsaid || !assumed || *metres != 1)) {
        write_height_unit(*definition, *metres);
      } else if (unsaid) {
        write_height_unit(*definition, assumed ? 1 : definition->metres_per_unit);
      }
      stream::Crs recorded = CoordinateSystem(*definition).crs_with_wkt1();
      recorded.vertical_unit = crs.vertical_unit;
      return recorded;
    }
    const std::optional<LocalCrs> local = local_crs_of(crs);
    // The WKT of a system with a third axis already has the unit.
    const bool states_unit = local && metres_in_unit(local->crs.vertical_unit) == metres;
    if (local && !local->is_geocentric && metres && !states_unit) {
      crs.wkt = with_height_unit(local->crs, *metres);
    }
  } catch (const CrsError&) {
    // The file repeats the record of the source.
  }
  return crs;
}

stream::CoordinateUnits units_of_point_file(const stream::Placement& placement,
                                            const std::optional<stream::Crs>& other) {
  if (is_geocentric(placement.crs)) return {};
  const std::string& named_unit = placement.coordinates[0].unit;
  stream::CoordinateUnits units;
  if (other) {
    units.horizontal = other->horizontal_unit;
  } else {
    units.horizontal = named_unit.empty() ? placement.crs.horizontal_unit : named_unit;
  }
  try {
    units.height = unit_of_heights(placement, other.has_value());
  } catch (const CrsError&) {
    // Readers of the file make the same assumption.
  }
  return units;
}

std::string lost_height_unit(const std::string& path, const stream::PointWriter& writer,
                             const stream::Placement& placement,
                             const std::optional<stream::Crs>& other) {
  if (is_geocentric(placement.crs) || writer.names_height_unit()) return {};
  try {
    const std::string unit = unit_of_heights(placement, other.has_value());
    // Without a CRS the unit is a code of a GeoKey, which these two units do not have.
    const bool codeless = unit == "inch" || unit == "decimetre";
    if (writer.records_units() && !(codeless && !definition_in_file(placement, other))) return {};
    if (unit.empty() || metres_in_unit(unit).value_or(0) == 1) return {};
    return path + ": heights are in " + plural_unit(unit) + ", and the format has no place for " +
           (writer.records_units() ? "that" : "a") + " unit, so programs read them as metres; " +
           (writer.records_units() ? "name the CRS to keep it"
                                   : "write LAS, LAZ or CSV to keep the unit");
  } catch (const CrsError&) {
    return {};
  }
}

}  // namespace terrace::terrain
